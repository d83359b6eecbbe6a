// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/simulation/camera.h"
#include "takt/simulation/imu.h"
#include "takt/simulation/motion.h"
#include "takt/streams/corners.h"

/// A camera and an IMU on one body, moved in front of a calibration board.
namespace takt {

struct BoardOptions {
  std::uint64_t seed = 1;
  double duration_s = 40;
  Motion motion = board_motion(1.6);
  double offset_s = 0.0073;  ///< of the clocks: reference − sensor in the middle of the recording
  double drift = 0;          ///< s/s
  double distance_m = 0.7;   ///< from the camera's mean place to the board's middle
  double tilt_rad = 0.15;    ///< σ of the board's leaning and turning away from the camera
  SimulatedCamera camera{.width = 752, .height = 480, .lens = Distortion::radtan, .fov_rad = 1.38};
  SimulatedImu imu{.gyro_bias_rad_s = 0.01, .accel_bias_m_s2 = 0.05};

  /// Excited about all axes with a rate of so many rad/s rms (0.6 to 3 Hz), moved at a third of a metre a second at
  /// 1.6 rad/s, in proportion else: the board stays in view, now and then in part.
  [[nodiscard]] static Motion board_motion(double turn_rad_s);
};

/// How a detector finds the corners.
struct SimulatedDetection {
  double noise_px = 0.07;       ///< σ of u and of v
  double outlier_fraction = 0;  ///< of the corners: seen 2 to 20 px away, in any direction
  double miss_fraction = 0.01;  ///< of the corners are not found
  double absent_until_s = 0;    ///< the board comes into view only then
};

/// The motion, and where the board stands so that the camera sees it in the mean, turned by a little.
struct BoardScene {
  std::shared_ptr<const Trajectory> trajectory;
  Eigen::Isometry3d world_from_board;
};
/// `middle`: of the board, in its own frame. `z_into_print`: the board's z axis points away from who looks at it.
[[nodiscard]] BoardScene make_board_scene(const BoardOptions& options, const Vec3& middle, bool z_into_print = false);

struct SimulatedBoard {
  CornerStream corners;
  ImuStream imu;
  Estimate truth;  ///< extras: gravity in the board's frame (gravity_board_x_m_s2 …)
  BoardScene scene;
  std::vector<Exposure> exposures;
};
/// Corners as a detector would give them, without any picture.
[[nodiscard]] SimulatedBoard simulate_board(const BoardOptions& options, const SimulatedDetection& detection,
                                            const std::vector<Vec3>& board);

/// A further camera on the same body, seeing the same board with its own noise. `clocks_offset_s`: reference − sensor.
[[nodiscard]] CornerStream simulate_corners(const BoardScene& scene, const SimulatedCamera& camera,
                                            const SimulatedDetection& detection, const std::vector<Vec3>& board,
                                            std::span<const Exposure> exposures, std::uint64_t seed);

/// What the offset of such a recording is, and where: `truth` of all simulators with a camera and an IMU on one body.
[[nodiscard]] Estimate board_truth(const BoardOptions& options, const BoardScene& scene);

}  // namespace takt
