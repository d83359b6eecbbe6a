// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/estimators/online/imu_history.h"
#include "takt/streams/streams.h"

/// Motion by dead reckoning, and how its errors grow. World: z up, gravity (0, 0, −9.81).
namespace takt::online {

/// Order of the errors of a motion: R_true = R·exp(θ), the others additive.
enum MotionError { at_theta = 0, at_position = 3, at_velocity = 6, at_gyro_bias = 9, at_accel_bias = 12 };
constexpr int motion_size = 15;
using Mat15 = Eigen::Matrix<double, motion_size, motion_size>;
using Vec15 = Eigen::Matrix<double, motion_size, 1>;

struct Motion {
  Quat R = Quat::Identity();  ///< R_world_imu
  Vec3 p = Vec3::Zero(), v = Vec3::Zero();
  Vec3 gyro_bias = Vec3::Zero(), accel_bias = Vec3::Zero();

  void add(const Eigen::Ref<const Vec15>& error);
};

/// Over an interval: error after = transition · error before + noise.
struct Transition {
  Mat15 transition = Mat15::Identity();
  Mat15 noise = Mat15::Zero();
};

/// Moves `motion` from t0 to t1; `errors`, where given, is continued.
void propagate(Motion& motion, const ImuHistory& imu, double t0, double t1, const ImuNoise& noise, Transition* errors);

/// Motion from t0 to t1 as seen in the IMU's frame at t0, without gravity [Forster2017]:
///   R1 = R0·dR,  v1 = v0 + g·dt + R0·dv,  p1 = p0 + v0·dt + g·dt²/2 + R0·dp
struct Increment {
  Quat dR = Quat::Identity();
  Vec3 dv = Vec3::Zero(), dp = Vec3::Zero();
  double dt = 0;
};
[[nodiscard]] Increment increment(const ImuHistory& imu, double t0, double t1, const Vec3& gyro_bias,
                                  const Vec3& accel_bias);

/// The motion at t1 from the one at t0, in either direction; no errors.
[[nodiscard]] Motion carried(const Motion& motion, const ImuHistory& imu, double t0, double t1);

}  // namespace takt::online
