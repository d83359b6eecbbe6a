// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/simulation/board_renderer.h"
#include "takt/simulation/imu.h"
#include "takt/simulation/motion.h"

namespace takt {

/// Cameras and an IMU on one body that is moved before a board, as for Kalibr.
struct TargetFilmOptions {
  std::uint64_t seed = 1;
  double duration_s = 40;
  Motion motion = target_motion();
  double offset_s = 0.0073;  ///< of cam0's clock: reference − sensor in the middle of the recording
  double drift = 0;          ///< s/s
  PrintedBoard scene;        ///< `world_from_board` is chosen: before cam0 in its mean pose
  double distance_m = 0.8;   ///< from cam0's mean position to the board's middle
  double tilt_rad = 0.2;     ///< of the board against the mean view
  int cameras = 1;
  double baseline_m = 0.11;         ///< from a camera to the next, along its x
  double camera_offset_step_s = 0;  ///< each further camera's offset is larger by this
  SimulatedCamera camera = target_camera();
  SimulatedImu imu;
  int threads = 0;

  /// 1.6 rad/s rms and 0.4 m/s rms about all axes.
  [[nodiscard]] static Motion target_motion();
  /// 752 × 480, EuRoC's lens, 20 frames/s, 2 ms.
  [[nodiscard]] static SimulatedCamera target_camera();
};

struct TargetFilm {
  Recording recording;
  Estimate truth;  ///< of cam0 against imu0; those of all cameras in `truth.estimates`
  std::shared_ptr<const Trajectory> trajectory;
  std::vector<SimulatedCamera> cameras;
  std::vector<std::vector<Exposure>> exposures;  ///< true times of each camera's frames
  Eigen::Isometry3d world_from_board;
  std::vector<Vec3> board;  ///< its points
};

/// Pictures are rendered when they are read.
[[nodiscard]] TargetFilm simulate_target(const TargetFilmOptions& options);

}  // namespace takt
