// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "takt/signals/long_pairs.h"
#include "takt/signals/pair_rotation.h"
#include "takt/streams/rotation_signal.h"

namespace takt {

/// A feature seen in two consecutive frames.
struct FollowedFeature {
  std::int64_t id;
  SeenBearing from, to;
};

/// Grows a camera's rotation signal frame by frame and keeps count of what could not be measured, to say it in words.
class RotationChain {
 public:
  /// `signal` brings name, clock, source, timing and model; increments and notes are added here.
  RotationChain(RotationSignal signal, PairRotationOptions options, double longest_step_s, double frame_step_s);

  /// The apparent rotation over the pair if it could be measured; otherwise the signal has a gap here.
  /// `from` is the frame added last (or the first of all); features by ascending id.
  std::optional<Vec3> add(Stamp from, Stamp to, const std::vector<FollowedFeature>& features);

  /// "3 of 100 frames ..." for what else happened to frames; nothing for a count of 0.
  void note(std::size_t count, std::size_t frames, const char* what);

  [[nodiscard]] RotationSignal finish(std::size_t frames);

 private:
  RotationSignal signal_;
  LongPairs long_pairs_;
  bool started_ = false;
  PairRotationOptions options_;
  double longest_step_s_;
  double rows_ = 0;  ///< sum over the matches that were seen
  std::size_t seen_ = 0;
  std::size_t late_ = 0, featureless_ = 0, unexplained_ = 0;
};

/// 0 for less than two stamps.
[[nodiscard]] double median_step_s(const std::vector<Stamp>& stamps);

}  // namespace takt
