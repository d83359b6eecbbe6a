// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "takt/signals/pair_rotation.h"
#include "takt/streams/rotation_signal.h"

namespace takt {

/// Grows a camera's rotation signal pair by pair and keeps count of what could not be measured, to say it in words.
class RotationChain {
 public:
  /// `signal` brings name, clock, source, timing and model; increments and notes are added here.
  RotationChain(RotationSignal signal, PairRotationOptions options, double longest_step_s);

  /// The rotation over the pair if it could be measured; otherwise the signal has a gap here.
  std::optional<Vec3> add(Stamp from, Stamp to, const std::vector<BearingMatch>& matches);

  /// "3 of 100 frames ..." for what else happened to frames; nothing for a count of 0.
  void note(std::size_t count, std::size_t frames, const char* what);

  [[nodiscard]] RotationSignal finish(std::size_t frames);

 private:
  RotationSignal signal_;
  PairRotationOptions options_;
  double longest_step_s_;
  std::size_t late_ = 0, featureless_ = 0, unexplained_ = 0;
};

/// 0 for less than two stamps.
[[nodiscard]] double median_step_s(const std::vector<Stamp>& stamps);

}  // namespace takt
