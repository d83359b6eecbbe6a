// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "takt/time/instant.h"

namespace takt {

/// What a block of samples says of time: the running number of its first sample, and when that was taken.
/// A block that claims an instant for its first sample is often late or early by some samples: blocks are cut when it
/// suits the recorder.
struct BlockMark {
  std::int64_t sample = 0;
  std::int64_t time_ns = 0;
};

/// When each sample of an evenly sampling sensor was taken: a robust straight line through the marks of the whole
/// recording, never a block's own count over its own duration. Where the marks step (a pause, a lost clock, a counter
/// that starts again) a new line begins.
class SampleClock {
 public:
  /// A straight piece of the clock, from block `first_mark` up to the next piece.
  struct Piece {
    std::size_t first_mark = 0;
    std::int64_t origin_sample = 0;
    double origin_ns = 0;  ///< relative to `epoch_ns`
    double period_ns = 0;
    double residual_rms_ns = 0;  ///< of the marks that the line follows
    std::size_t outliers = 0;    ///< marks farther off than 4 robust standard deviations
  };

  /// `nominal_period_ns` serves where one mark alone says no rate. `tolerance_ns` is how far marks may scatter however
  /// well they usually agree: a smaller step is not looked for.
  /// Throws std::invalid_argument without marks, or for a period that is not positive.
  SampleClock(const std::vector<BlockMark>& marks, double nominal_period_ns, double tolerance_ns);

  /// When sample `sample` of block `mark` was taken; held at ±63 years where marks make no sense.
  [[nodiscard]] std::int64_t time_ns(std::size_t mark, std::int64_t sample) const;
  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }
  [[nodiscard]] double period_ns() const { return pieces_.front().period_ns; }

 private:
  std::int64_t epoch_ns_ = 0;
  std::vector<Piece> pieces_;
};

}  // namespace takt
