// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/window/imu_link.h"

#include <Eigen/Cholesky>

#include "takt/motion/trajectory.h"

namespace takt::online {

namespace {

constexpr double stale_gyro_bias = 2e-3, stale_accel_bias = 2e-2;

}  // namespace

ImuLink::ImuLink(const ImuHistory& imu, double t0, double t1, const Motion& biases_of, const ImuNoise& noise)
    : gyro_bias_(biases_of.gyro_bias), accel_bias_(biases_of.accel_bias) {
  const Increment by = increment(imu, t0, t1, gyro_bias_, accel_bias_);
  dt_ = by.dt, rotation_ = by.dR, position_ = by.dp, velocity_ = by.dv;
  Motion from_rest;
  from_rest.gyro_bias = gyro_bias_, from_rest.accel_bias = accel_bias_;
  Transition errors;
  propagate(from_rest, imu, t0, t1, noise, &errors);
  by_bias_ = errors.transition;
  // Rounding of the integration, so that an interval of no length has an inverse too.
  Mat15 covariance = errors.noise;
  covariance.diagonal().array() += 1e-16;
  information_ = covariance.llt().solve(Mat15::Identity());
  information_ = 0.5 * (information_ + information_.transpose()).eval();
}

bool ImuLink::stale(const Motion& from) const {
  return (from.gyro_bias - gyro_bias_).norm() > stale_gyro_bias ||
         (from.accel_bias - accel_bias_).norm() > stale_accel_bias;
}

Vec15 ImuLink::residual(const Motion& from, const Motion& to) const {
  Eigen::Matrix<double, 6, 1> bias;
  bias << from.gyro_bias - gyro_bias_, from.accel_bias - accel_bias_;
  const Eigen::Matrix<double, 9, 1> moved = by_bias_.block<9, 6>(0, at_gyro_bias) * bias;
  const Vec3 g = gravity_world();
  Vec15 r;
  r.segment<3>(at_theta) = log_so3((rotation_ * exp_so3(moved.head<3>())).conjugate() * from.R.conjugate() * to.R);
  r.segment<3>(at_position) = from.R.conjugate() * (to.p - from.p - dt_ * from.v - (0.5 * dt_ * dt_) * g) - position_ -
                              moved.segment<3>(at_position);
  r.segment<3>(at_velocity) =
      from.R.conjugate() * (to.v - from.v - dt_ * g) - velocity_ - moved.segment<3>(at_velocity);
  r.segment<3>(at_gyro_bias) = to.gyro_bias - from.gyro_bias;
  r.segment<3>(at_accel_bias) = to.accel_bias - from.accel_bias;
  return r;
}

ImuLink::Jacobians ImuLink::jacobians(const Motion& from, const Motion& to) const {
  const Vec3 g = gravity_world();
  const Mat3 back = from.R.conjugate().toRotationMatrix();
  const Mat3 unwind = right_jacobian_inverse(residual(from, to).segment<3>(at_theta));
  Jacobians j{Mat15::Zero(), Mat15::Zero()};
  j.to_from.block<3, 3>(at_theta, at_theta) = -unwind * (to.R.conjugate() * from.R).toRotationMatrix();
  j.to_from.block<3, 3>(at_theta, at_gyro_bias) = -unwind.transpose() * by_bias_.block<3, 3>(at_theta, at_gyro_bias);
  j.to_to.block<3, 3>(at_theta, at_theta) = unwind;
  j.to_from.block<3, 3>(at_position, at_theta) = hat(back * (to.p - from.p - dt_ * from.v - (0.5 * dt_ * dt_) * g));
  j.to_from.block<3, 3>(at_position, at_position) = -back;
  j.to_from.block<3, 3>(at_position, at_velocity) = -dt_ * back;
  j.to_to.block<3, 3>(at_position, at_position) = back;
  j.to_from.block<3, 3>(at_velocity, at_theta) = hat(back * (to.v - from.v - dt_ * g));
  j.to_from.block<3, 3>(at_velocity, at_velocity) = -back;
  j.to_to.block<3, 3>(at_velocity, at_velocity) = back;
  j.to_from.block<6, 6>(at_position, at_gyro_bias) = -by_bias_.block<6, 6>(at_position, at_gyro_bias);
  j.to_from.block<6, 6>(at_gyro_bias, at_gyro_bias) = -Eigen::Matrix<double, 6, 6>::Identity();
  j.to_to.block<6, 6>(at_gyro_bias, at_gyro_bias).setIdentity();
  return j;
}

}  // namespace takt::online
