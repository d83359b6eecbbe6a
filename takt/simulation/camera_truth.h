// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/simulation/camera.h"
#include "takt/simulation/imu.h"

namespace takt {

/// What an estimator should find of a camera against an IMU on the same body. The offset is the clocks' plus the IMU's
/// delay: what makes the IMU's stamps fit the middles of the first row's exposures. `extras` has its parts.
/// `clocks`: the camera's against the IMU's.
[[nodiscard]] Estimate camera_truth(const std::string& name, const SimulatedCamera& camera, const SimulatedImu& imu,
                                    const SimulatedClocks& clocks, double duration_s, std::uint64_t seed);

}  // namespace takt
