// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "takt/time/instant.h"

namespace takt::online {

/// Audits a stream's stamps as they come, in bounded memory.
class StampWatch {
 public:
  enum class Fate { good, duplicate, backward };
  Fate observe(Stamp stamp);

  /// Median step of late (s); 0 before there are two stamps.
  [[nodiscard]] double step_s() const { return step_s_; }
  /// Robust σ of stamps against an even grid of late (s), for streams that keep one; 0 where it cannot be told.
  [[nodiscard]] double jitter_s() const { return jitter_s_; }
  [[nodiscard]] std::size_t good() const { return good_; }
  [[nodiscard]] std::size_t refused() const { return duplicates_ + backward_; }
  /// What is wrong with the stream, in sentences.
  [[nodiscard]] std::vector<std::string> words() const;

 private:
  void measure();

  std::deque<Stamp> late_;
  std::size_t good_ = 0, duplicates_ = 0, backward_ = 0, missing_ = 0, gaps_ = 0;
  double longest_gap_s_ = 0, step_s_ = 0, jitter_s_ = 0;
};

}  // namespace takt::online
