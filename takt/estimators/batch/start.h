// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/calibration/evidence.h"
#include "takt/estimators/batch/session.h"

namespace takt::batch {

/// Rotation and offset from the motion alone, without any first guess: takt's angular-rate alignment with the board's
/// attitudes as the rotations of the camera.
struct Start {
  std::string refusal;  ///< why there is none; empty if there is one
  double offset_s = 0;  ///< internal, at `centre_s`
  double drift = 0;
  double centre_s = 0;
  double lobe_s = 0;  ///< half-width of the correlation's main lobe
  double correlation = 0;
  double turn_ratio = 1;  ///< how much further the gyro turned than the camera: 57 for a gyro in degrees
  Mat3 R_imu_cam = Mat3::Identity();
  Panel curve;
};
[[nodiscard]] Start find_start(const CameraSession& camera, const ImuSession& imu);

}  // namespace takt::batch
