// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "takt/signals/feature_tracker.h"
#include "takt/streams/streams.h"

namespace takt {

/// The features of one picture that were followed into it.
struct FollowedFrame {
  std::size_t index = 0;  ///< place in the stream's stamps
  Stamp stamp;
  double exposure_s = 0;  ///< 0 where unknown
  std::vector<TrackedFeature> features;
};

/// Feature tracks of a camera, picture by picture as they are asked for: corners are followed, and what does not move
/// as a rigid scene does is left out and comes back under a new id. Pictures that repeat the one before are left out.
class FeatureTrackReader {
 public:
  /// Throws std::invalid_argument where the stream has no pictures or the model is for another size.
  FeatureTrackReader(const CameraStream& stream, const CameraModel& model, FeatureTrackerOptions options = {});
  ~FeatureTrackReader();
  FeatureTrackReader(FeatureTrackReader&&) noexcept;

  std::optional<FollowedFrame> next();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt
