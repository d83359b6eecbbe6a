// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "takt/estimators/online/offset_tracker.h"
#include "takt/recording/format.h"
#include "takt/workflows/align.h"

/// `takt track`: a camera's offset against an IMU as it comes to be known, frame by frame.
namespace takt {

struct TrackJob {
  std::string input;
  std::string sensor, reference;  ///< stream names; empty: all cameras, the first of which is answered; the first IMU
  OpenOptions open;
  TrackingOptions tracking;
  /// Called after every frame of the sensor that changed the answer.
  std::function<void(const OffsetNow&)> on_estimate;
  /// Called for every new pose.
  std::function<void(const PoseNow&)> on_pose;
  std::function<void(double)> progress;  ///< 0 … 1
};

/// The last answer; its pieces follow the offset where one line does not.
[[nodiscard]] Outcome track(const TrackJob& job);

}  // namespace takt
