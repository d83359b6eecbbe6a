// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "takt/motion/trajectory.h"
#include "takt/simulation/clock.h"
#include "takt/streams/streams.h"

namespace takt {

/// A camera on the body: its lens, its shutter and what its stamps mean.
struct SimulatedCamera {
  int width = 640, height = 480;
  Distortion lens = Distortion::none;  ///< radtan and equidistant have the coefficients of EuRoC's and TUM-VI's cameras
  double fov_rad = 0;                  ///< horizontal; 0: 70°, 120° for the equidistant lens
  std::optional<CameraModel> exactly = {};  ///< instead of the four lines above
  double rate_hz = 20;
  double exposure_s = 0.005;
  double exposure_swing = 0;  ///< auto-exposure: the exposure varies by this fraction, slowly
  ExposureInstant stamp = ExposureInstant::middle;
  double readout_s = 0;      ///< rolling shutter; 0: global
  double jitter_s = 0;       ///< σ of the stamps, cut at ±45 % of the interval so that their order holds
  double drop_fraction = 0;  ///< frames that never arrive
  /// Looks along the body's x axis, tilted a little about each axis so that no axis is special.
  Mat4 T_body_cam = default_mount();

  [[nodiscard]] CameraModel model() const;
  [[nodiscard]] FrameTiming timing() const;
  [[nodiscard]] static Mat4 default_mount();
};

/// When a frame was truly exposed and what its stamp says. True times are seconds as in the trajectory.
struct Exposure {
  double middle_s = 0;  ///< of the first row
  double exposure_s = 0;
  Stamp stamp;  ///< on the sensor's clock
};

/// Frames whose exposure and readout lie within [0, duration_s], dropped ones left out. The first frame comes at a
/// seeded moment, so that frames and IMU samples do not share a grid.
[[nodiscard]] std::vector<Exposure> simulate_exposures(const SimulatedCamera& camera, const SimulatedClocks& clocks,
                                                       double duration_s, std::uint64_t seed);

/// The camera's pose at a true time: takes points from the world to the camera.
[[nodiscard]] Eigen::Isometry3d cam_from_world(const Trajectory& truth, const Mat4& T_body_cam, double t_s);

}  // namespace takt
