// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/simulation/camera.h"
#include "takt/simulation/imu.h"
#include "takt/simulation/motion.h"
#include "takt/simulation/renderer.h"
#include "takt/simulation/tracks.h"

namespace takt {

/// What the camera leaves behind.
enum class Footage { images, tracks };

/// A camera and an IMU on one body, moving as `motion` says in a textured room. Each field:
/// takt/simulation/parameters.h.
struct HandheldOptions {
  std::uint64_t seed = 1;
  double duration_s = 10;
  Motion motion = find_motion("handheld");
  double offset_s = 0.0123;  ///< of the clocks: reference − sensor in the middle of the recording
  double drift = 0;          ///< s/s
  double step_s = 0;         ///< by which the offset jumps at `step_at_s` after the start
  double step_at_s = 0;
  bool stereo = false;         ///< a second camera, cam1, 0.11 m to the right of the first
  double stereo_offset_s = 0;  ///< cam1's offset less cam0's
  Footage footage = Footage::images;
  SimulatedCamera camera;
  SimulatedImu imu;
  SimulatedTracking tracking;
  ImageNoise image_noise;
  int threads = 0;  ///< that render pictures; 0: as many as there are cores
};

/// Streams as a reader would give them, and what an estimator should find.
struct SimulatedRecording {
  Recording recording;
  Estimate truth;
  std::shared_ptr<const Trajectory> trajectory;
  std::vector<Exposure> exposures;  ///< true times of the frames
  SimulatedClocks clocks;
};

/// `truth.offset` is the clocks' offset plus the IMU's delay: what makes the IMU's stamps fit the camera's exposure
/// middles. Its parts are in `truth.extras`. Pictures are rendered when they are read.
[[nodiscard]] SimulatedRecording simulate_handheld(const HandheldOptions& options);

}  // namespace takt
