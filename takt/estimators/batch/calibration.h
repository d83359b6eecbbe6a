// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "takt/math/arrow_system.h"
#include "takt/motion/rigid.h"
#include "takt/motion/spline_basis.h"

/// What a calibration seeks beside the motion: the same for both models.
namespace takt::batch {

/// How one camera stands to the IMU. IMU seconds = camera seconds + offset + drift·(camera seconds − centre)
/// + row·line_delay, both counted from the streams' epochs.
struct CameraLink {
  Rigid T_imu_cam;
  double offset_s = 0;
  double drift = 0;
  double centre_s = 0;
  double line_delay_s = 0;

  [[nodiscard]] double imu_time(double camera_s, double row = 0) const {
    return camera_s + offset_s + drift * (camera_s - centre_s) + row * line_delay_s;
  }
};

/// Biases that change slowly: a quadratic spline each.
struct BiasCurve {
  static constexpr int order = 3;

  /// Over [begin, end] in IMU seconds, knots about `interval_s` apart; zero.
  BiasCurve(double begin_s, double end_s, double interval_s);

  struct Place {
    int first;                          ///< of the three control points that act
    Eigen::Matrix<double, order, 1> w;  ///< their weights
  };
  /// Times beyond the ends are taken as the ends.
  [[nodiscard]] Place at(double t) const;
  [[nodiscard]] Vec3 gyro(const Place& p) const { return gyro_points.middleCols<order>(p.first) * p.w; }
  [[nodiscard]] Vec3 accel(const Place& p) const { return accel_points.middleCols<order>(p.first) * p.w; }
  [[nodiscard]] int points() const { return knots.control_points(); }

  double begin_s;
  UniformKnots<order> knots;
  Eigen::Matrix3Xd gyro_points, accel_points;  ///< rad/s, m/s²
};

struct Calibration {
  std::vector<CameraLink> cameras;
  Vec3 gravity_board = Vec3::Zero();  ///< m/s²
  double board_scale = 1;             ///< metres that the accelerometer sees for each of the board's
  BiasCurve bias{0, 1, 1};
};

/// Measured noise.
struct Noise {
  double corner_px = 0;      ///< one coordinate
  double gyro_density = 0;   ///< rad/s/√Hz
  double accel_density = 0;  ///< m/s²/√Hz
  double jitter_s = 0;       ///< of the frames' stamps
};

/// Where the unknowns of the calibration block stand in the border; −1: not estimated.
struct BorderLayout {
  struct Camera {
    int rotation = -1, translation = -1;  ///< three each
    int offset = -1;                      ///< `windows` of them
    int drift = -1, line_delay = -1;
    int intrinsics = -1;
  };
  std::vector<Camera> cameras;
  int windows = 1;                                ///< offsets of the first camera, one a window
  int gravity = -1, board_scale = -1, bias = -1;  ///< bias: six a control point, gyro's first
  int size = 0;
};

/// Moves the calibration by a step over the border (relative to `layout`, without windows).
void retract(Calibration& c, const BorderLayout& layout, const Eigen::Ref<const Eigen::VectorXd>& step);

/// Magnitude of gravity on Earth (m/s²); it varies by 0.03 from place to place.
inline constexpr double earth_gravity = 9.806;

/// What is known beforehand, and loosely enough to leave every decision to data that have something to say: the length
/// of gravity and the board's scale. `border`: where the border begins in the system.
void add_priors(const Calibration& c, const BorderLayout& layout, int border, ArrowSystem& system);

}  // namespace takt::batch
