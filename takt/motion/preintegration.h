// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

#include "takt/motion/imu_curve.h"

namespace takt {

using Mat9 = Eigen::Matrix<double, 9, 9>;

/// White noise of an IMU as continuous densities.
struct ImuDensity {
  double gyro;   ///< rad/s/√Hz
  double accel;  ///< m/s²/√Hz
};

/// What an IMU says of its motion from t0 to t1, whatever pose and velocity it had at t0 [Forster2017] eq. 33:
///   R1 = R0·ΔR,   v1 = v0 + g·Δt + R0·Δv,   p1 = p0 + v0·Δt + ½·g·Δt² + R0·Δp
/// Rotations are perturbed on the right, ΔR ← ΔR·Exp(δ); Δv and Δp are in the body's frame at t0.
struct Preintegrated {
  /// How the three increments move; the rotation's part is the δ above.
  struct Change {
    Vec3 rotation = Vec3::Zero();  ///< rad a unit
    Vec3 velocity = Vec3::Zero();  ///< m/s a unit
    Vec3 position = Vec3::Zero();  ///< m a unit
  };

  double duration_s = 0;                 ///< Δt
  Quat rotation = Quat::Identity();      ///< ΔR = R_t0_t1
  Vec3 velocity = Vec3::Zero();          ///< Δv, m/s
  Vec3 position = Vec3::Zero();          ///< Δp, m
  Mat3 rotation_to_gyro = Mat3::Zero();  ///< δ a change of the gyro's bias (rad/s)
  Mat3 velocity_to_gyro = Mat3::Zero();
  Mat3 velocity_to_accel = Mat3::Zero();  ///< a change of the accelerometer's bias (m/s²)
  Mat3 position_to_gyro = Mat3::Zero();
  Mat3 position_to_accel = Mat3::Zero();
  Change to_start, to_end;         ///< when t0, or t1, comes a second later; their sum: when the interval slides
  Mat9 covariance = Mat9::Zero();  ///< of (δ, Δv, Δp) from the white noise
};

/// Integrates on the manifold from sample to sample, to fourth order in the rotation and third in the rest, so that the
/// error for a motion of bandwidth f sampled at r Hz is of order (f/r)³ and better. Biases are taken off the readings.
/// Needs curve.covers(t0, t1), t0 ≤ t1 (std::invalid_argument otherwise).
[[nodiscard]] Preintegrated preintegrate(const ImuCurve& curve, double t0, double t1, const Vec3& gyro_bias,
                                         const Vec3& accel_bias, const ImuDensity& noise);

}  // namespace takt
