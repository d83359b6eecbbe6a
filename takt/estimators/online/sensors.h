// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/streams/streams.h"

/// What the online estimators are given: a rig, once, and its samples as they come.
namespace takt {

struct ImuSample {
  Stamp stamp;
  Vec3 gyro_rad_s = Vec3::Zero();
  Vec3 accel_m_s2 = Vec3::Zero();
};

/// Where one camera saw features. Ids last as long as a feature is followed without a gap; order does not matter.
struct TrackedFrame {
  Stamp stamp;
  double exposure_s = 0;  ///< 0 where unknown: then the rig's timing has it
  std::vector<TrackedFeature> features;
};

struct TrackingCamera {
  std::string name;
  CameraModel model;
  FrameTiming timing;
  Mat4 T_imu_cam = Mat4::Identity();
  std::optional<double> pixel_sigma;  ///< of u and of v; measured where it is not known
};

struct TrackingRig {
  std::string imu_name;
  std::optional<ImuNoise> imu_noise;  ///< a usual MEMS sensor's where it is not known
  std::vector<TrackingCamera> cameras;
};

/// The rig's IMU noise; a usual MEMS sensor's where the recording does not say.
[[nodiscard]] inline ImuNoise imu_noise_of(const TrackingRig& rig) {
  constexpr ImuNoise usual{
      .gyro_density = 5e-4, .gyro_random_walk = 5e-5, .accel_density = 5e-3, .accel_random_walk = 5e-3};
  return rig.imu_noise.value_or(usual);
}

}  // namespace takt
