// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/imu_motion.h"

#include <cmath>

#include "takt/motion/trajectory.h"

namespace takt::online {

namespace {

constexpr double gauss = ImuHistory::gauss;

/// One piece between two samples: rotation vector (Magnus, fourth order), and specific force integrated once and twice
/// in the frame at its start, by Gauss's rule.
struct Piece {
  Piece(double h, const Reading& a, const Reading& b, const Vec3& gyro_bias, const Vec3& accel_bias) {
    const Vec3 w1 = a.gyro - gyro_bias, w2 = b.gyro - gyro_bias;
    const Vec3 rate = 0.5 * (w1 + w2);
    rotation = h * rate + (0.5 * gauss * h * h) * w1.cross(w2);
    const double s1 = (0.5 - gauss) * h, s2 = (0.5 + gauss) * h;
    // To each Gauss point with the mean rate up to there, linear in time.
    const Vec3 slope = (w2 - w1) / (2 * gauss * h);
    const auto turned = [&](double s, const Vec3& force) -> Vec3 {
      const Vec3 angle = s * (rate + slope * (0.5 * s - 0.5 * h));
      return exp_so3(angle) * force;
    };
    const Vec3 f1 = turned(s1, a.accel - accel_bias), f2 = turned(s2, b.accel - accel_bias);
    velocity = 0.5 * h * (f1 + f2);
    position = 0.5 * h * ((h - s1) * f1 + (h - s2) * f2);
  }
  Vec3 rotation, velocity, position;
};

}  // namespace

void Motion::add(const Eigen::Ref<const Vec15>& error) {
  R = (R * exp_so3(error.segment<3>(at_theta))).normalized();
  p += error.segment<3>(at_position);
  v += error.segment<3>(at_velocity);
  gyro_bias += error.segment<3>(at_gyro_bias);
  accel_bias += error.segment<3>(at_accel_bias);
}

void propagate(Motion& m, const ImuHistory& imu, double t0, double t1, const ImuNoise& noise, Transition* errors) {
  const Vec3 g = gravity_world();
  imu.walk(t0, t1, [&](double h, const Reading& a, const Reading& b) {
    const Piece piece(h, a, b, m.gyro_bias, m.accel_bias);
    const ExpAndJacobian turn = exp_and_jacobian(piece.rotation);
    const Mat3 R = m.R.toRotationMatrix();
    if (errors) {
      const Mat3 middle = R * exp_so3(0.5 * piece.rotation).toRotationMatrix();
      const Mat3 R_force = R * hat(piece.velocity);
      Mat15 F = Mat15::Identity();
      F.block<3, 3>(at_theta, at_theta) = turn.rotation.toRotationMatrix().transpose();
      F.block<3, 3>(at_theta, at_gyro_bias) = -h * turn.right_jacobian;
      F.block<3, 3>(at_velocity, at_theta) = -R_force;
      F.block<3, 3>(at_velocity, at_gyro_bias) = 0.5 * h * R_force;
      F.block<3, 3>(at_velocity, at_accel_bias) = -h * middle;
      F.block<3, 3>(at_position, at_theta) = -R * hat(piece.position);
      F.block<3, 3>(at_position, at_velocity) = h * Mat3::Identity();
      F.block<3, 3>(at_position, at_gyro_bias) = (h * h / 6) * R_force;
      F.block<3, 3>(at_position, at_accel_bias) = (-0.5 * h * h) * middle;
      errors->transition = F * errors->transition;
      errors->noise = F * errors->noise * F.transpose();
      const auto add = [&](int at, double variance) {
        for (int i = 0; i < 3; ++i) errors->noise(at + i, at + i) += variance;
      };
      add(at_theta, h * noise.gyro_density * noise.gyro_density);
      add(at_velocity, h * noise.accel_density * noise.accel_density);
      add(at_gyro_bias, h * noise.gyro_random_walk * noise.gyro_random_walk);
      add(at_accel_bias, h * noise.accel_random_walk * noise.accel_random_walk);
    }
    m.p += h * m.v + (0.5 * h * h) * g + R * piece.position;
    m.v += h * g + R * piece.velocity;
    m.R = (m.R * turn.rotation).normalized();
  });
}

Increment increment(const ImuHistory& imu, double t0, double t1, const Vec3& gyro_bias, const Vec3& accel_bias) {
  Increment out;
  imu.walk(t0, t1, [&](double h, const Reading& a, const Reading& b) {
    const Piece piece(h, a, b, gyro_bias, accel_bias);
    out.dp += h * out.dv + out.dR * piece.position;
    out.dv += out.dR * piece.velocity;
    out.dR = (out.dR * exp_so3(piece.rotation)).normalized();
    out.dt += h;
  });
  return out;
}

Motion carried(const Motion& motion, const ImuHistory& imu, double t0, double t1) {
  const Vec3 g = gravity_world();
  Motion out = motion;
  const Increment by = increment(imu, std::min(t0, t1), std::max(t0, t1), motion.gyro_bias, motion.accel_bias);
  const double dt = by.dt;
  if (t1 >= t0) {
    out.R = (motion.R * by.dR).normalized();
    out.v = motion.v + dt * g + motion.R * by.dv;
    out.p = motion.p + dt * motion.v + 0.5 * dt * dt * g + motion.R * by.dp;
  } else {
    out.R = (motion.R * by.dR.conjugate()).normalized();
    out.v = motion.v - dt * g - out.R * by.dv;
    out.p = motion.p - dt * out.v - 0.5 * dt * dt * g - out.R * by.dp;
  }
  return out;
}

}  // namespace takt::online
