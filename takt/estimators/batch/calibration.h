// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "takt/math/arrow_system.h"
#include "takt/motion/preintegration.h"
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

/// How an IMU stands to the body, whose frame and clock are the first IMU's, and what it makes of the motion there:
///   rates G·(ω + c_g·ω̈) + b_g,   specific forces A·(f + c_a·f̈ − τ·ḟ) + b_a
/// with G, A the identity, and c, τ none, for an IMU that is what its data sheet says.
struct ImuLink {
  Rigid T_body_imu;
  double offset_s = 0;  ///< body seconds = IMU seconds + offset + drift·(IMU seconds − centre)
  double drift = 0;
  double centre_s = 0;
  Mat3 gyro_matrix = Mat3::Identity();
  Mat3 accel_matrix = Mat3::Identity();        ///< lower triangular: the accelerometer's axes are the IMU's
  double gyro_bend_s2 = 0, accel_bend_s2 = 0;  ///< c: second order of a low-pass in the IMU
  double accel_lag_s = 0;                      ///< τ: forces are later than rates
  BiasCurve bias{0, 1, 1};

  [[nodiscard]] double body_time(double imu_s) const { return imu_s + offset_s + drift * (imu_s - centre_s); }
  [[nodiscard]] bool filtered() const { return gyro_bend_s2 != 0 || accel_bend_s2 != 0 || accel_lag_s != 0; }
};

struct Calibration {
  std::vector<CameraLink> cameras;
  std::vector<ImuLink> imus;          ///< the first is the body
  Vec3 gravity_board = Vec3::Zero();  ///< m/s²
  double board_scale = 1;             ///< metres that the accelerometer sees for each of the board's
};

/// Measured noise.
struct CameraNoise {
  double corner_px = 0;  ///< one coordinate
  double jitter_s = 0;   ///< of the frames' stamps
};
struct Noise {
  std::vector<CameraNoise> cameras;
  std::vector<ImuDensity> imus;
};

/// Where the unknowns of the calibration block stand in the border; −1: not estimated.
struct BorderLayout {
  struct Camera {
    int rotation = -1, translation = -1;  ///< three each
    int offset = -1;                      ///< one; of the camera in windows: `windows` of them
    int drift = -1, line_delay = -1;
  };
  struct Imu {
    int bias = -1;                        ///< six a control point, gyro's first
    int rotation = -1, translation = -1;  ///< three each; of further IMUs
    int offset = -1, drift = -1;
    int matrices = -1;  ///< nine of G by rows, six of A by rows
    int response = -1;  ///< c of the gyro, c of the accelerometer, τ
  };
  static constexpr int matrices_size = 15, response_size = 3;
  std::vector<Camera> cameras;
  std::vector<Imu> imus;
  int windows = 1, windowed = 0;  ///< offsets in a row, one a window, of this camera
  int gravity = -1, board_scale = -1;
  int size = 0;
};

/// Moves the calibration by a step over the border (relative to `layout`, without windows).
void retract(Calibration& c, const BorderLayout& layout, const Eigen::Ref<const Eigen::VectorXd>& step);

/// Magnitude of gravity on Earth (m/s²); it varies by 0.03 from place to place.
inline constexpr double earth_gravity = 9.806;

/// What is known beforehand, and loosely enough to leave every decision to data that have something to say: the length
/// of gravity, the board's scale, and that biases are much the same from one control point to the next. Where an
/// accelerometer's own scale is sought, gravity's length is the measure: as far as it varies over the Earth. `border`:
/// where the border begins in the system.
void add_priors(const Calibration& c, const BorderLayout& layout, int border, ArrowSystem& system);

/// c_g, c_a and τ as one of three.
[[nodiscard]] Vec3 response_of(const ImuLink& imu);

}  // namespace takt::batch
