// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/estimators/batch/discrete.h"

/// From calibrations of pairs, a camera and an IMU each, to where the whole rig's begins.
namespace takt::batch {

/// Cameras and IMUs on one body, which is the first IMU.
struct Rig {
  std::vector<const CameraSession*> cameras;
  std::vector<const ImuSession*> imus;
};

struct Anchor {
  double time_s = 0;  ///< body seconds
  BodyState state;
};

struct MotionStart {
  Calibration calibration;
  std::vector<std::vector<ChainFrame>> chains;  ///< one a camera
  std::vector<Anchor> anchors;                  ///< of all cameras, in order of time
};

/// `cameras`: one a camera, each against the body; `imus`: the first camera against each further IMU.
[[nodiscard]] MotionStart join_pairs(const std::vector<const DiscreteFit*>& cameras,
                                     const std::vector<const DiscreteFit*>& imus);

}  // namespace takt::batch
