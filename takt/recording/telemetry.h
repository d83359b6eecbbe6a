// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/recording/gpmf.h"
#include "takt/recording/media_index.h"
#include "takt/recording/sample_clock.h"

namespace takt {

/// One kind of sample over a whole recording, on the media time.
struct TelemetryTable {
  std::string key;    ///< "GYRO"
  gpmf::Stream head;  ///< what the first block says of it (axes, units, device); its data are those of one block
  std::vector<Stamp> stamps;  ///< one a row
  std::size_t columns = 0;
  std::vector<double> values;  ///< row after row
  double rate_hz = 0;
  std::string note;  ///< how the stamps were made: rate, residual, steps

  [[nodiscard]] std::size_t rows() const { return stamps.size(); }
  [[nodiscard]] const double* row(std::size_t i) const { return values.data() + i * columns; }
};

/// All payloads of a GPMF track. Stamps are fitted over the whole file: from the camera's own µs clock (STMP) where it
/// wrote one, else from the times of the payloads.
class Telemetry {
 public:
  explicit Telemetry(const std::vector<MediaIndex::Payload>& payloads);

  /// The samples of the first device that has them with so many columns; nothing where there are none.
  [[nodiscard]] std::optional<TelemetryTable> table(const std::string& key, std::size_t columns) const;
  /// Damaged payloads, and what ties the camera's clock to the media time.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Block {
    Stamp start;  // of the payload
    Duration duration{0};
    gpmf::Stream stream;
  };
  [[nodiscard]] std::vector<Block> blocks(const std::string& key, std::size_t columns) const;
  void tie_camera_clock();

  std::vector<Block> blocks_;  // all streams of all payloads, in order
  // Camera clock to media time: a "sample" of this clock is a microsecond, a mark is a payload.
  std::optional<SampleClock> camera_clock_;
  std::vector<Stamp> camera_clock_marks_;  // the payload of each mark
  std::vector<std::string> notes_;
};

}  // namespace takt
