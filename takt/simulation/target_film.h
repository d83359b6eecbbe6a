// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/simulation/board_renderer.h"
#include "takt/simulation/imu.h"
#include "takt/simulation/motion.h"

namespace takt {

/// Cameras and IMUs on one body that is moved before a board, as for Kalibr.
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
  bool triggered_together = false;  ///< all cameras take their frames at the same instants
  SimulatedCamera camera = target_camera();
  SimulatedImu imu;
  int imus = 1;                  ///< further ones sit 6 cm from one to the next, turned a radian
  double imu_offset_step_s = 0;  ///< by which imu0's clock is ahead of each further one's: imu0 − imuN
  int threads = 0;

  /// Turned about all axes with so many rad/s rms, moved at a quarter of that in m/s.
  [[nodiscard]] static Motion target_motion(double turn_rad_s = 1.6);
  /// 752 × 480, EuRoC's lens, 20 frames/s, 2 ms.
  [[nodiscard]] static SimulatedCamera target_camera();
};

struct TargetFilm {
  Recording recording;
  Estimate truth;  ///< of cam0 against imu0; in `estimates` all cameras', if several, and further IMUs' against imu0
  std::shared_ptr<const Trajectory> trajectory;
  std::vector<SimulatedCamera> cameras;
  std::vector<std::vector<Exposure>> exposures;  ///< true times of each camera's frames
  Eigen::Isometry3d world_from_board;
  std::vector<Vec3> board;  ///< its points
};

/// Pictures are rendered when they are read: a film that nobody reads costs next to nothing.
/// `truth.extras`: gravity in the board's frame too (gravity_board_x_m_s2 …).
[[nodiscard]] TargetFilm simulate_target(const TargetFilmOptions& options);

}  // namespace takt
