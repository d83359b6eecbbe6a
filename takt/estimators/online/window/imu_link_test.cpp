// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/window/imu_link.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/math/check_derivative.h"
#include "takt/motion/trajectory.h"

namespace takt::online {
namespace {

/// A second of an IMU that turns and accelerates about all axes.
ImuHistory lively_imu() {
  ImuHistory imu;
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.005 * i;
    imu.add(t, {Vec3(0.9 * std::sin(5 * t), 1.1 * std::cos(3 * t), -0.7 + t),
                Vec3(1 + std::sin(7 * t), 9 - 2 * std::cos(4 * t), 3 * std::sin(2 * t))});
  }
  return imu;
}

Motion some_motion() {
  Motion m;
  m.R = exp_so3(Vec3(0.3, -0.8, 1.2));
  m.p = Vec3(1, -2, 0.5), m.v = Vec3(0.4, 0.9, -0.3);
  m.gyro_bias = Vec3(0.01, -0.02, 0.005), m.accel_bias = Vec3(0.1, -0.05, 0.2);
  return m;
}

constexpr ImuNoise noise{
    .gyro_density = 2e-4, .gyro_random_walk = 2e-5, .accel_density = 2e-3, .accel_random_walk = 3e-3};

TEST(ImuLink, IsSatisfiedByDeadReckoning) {
  const ImuHistory imu = lively_imu();
  const Motion from = some_motion();
  Motion to = from;
  propagate(to, imu, 0.1, 0.43, noise, nullptr);
  const ImuLink link(imu, 0.1, 0.43, from, noise);
  EXPECT_NEAR(link.duration_s(), 0.33, 1e-12);
  EXPECT_LT(link.residual(from, to).norm(), 1e-9);
}

TEST(ImuLink, FollowsTheBiasesToFirstOrder) {
  const ImuHistory imu = lively_imu();
  const ImuLink link(imu, 0.1, 0.43, some_motion(), noise);
  const auto left_after = [&](double share) {
    Motion from = some_motion();
    from.gyro_bias += share * Vec3(1e-3, -6e-4, 8e-4), from.accel_bias += share * Vec3(-8e-3, 4e-3, 6e-3);
    EXPECT_FALSE(link.stale(from));
    Motion to = from;
    propagate(to, imu, 0.1, 0.43, noise, nullptr);
    return link.residual(from, to).norm();
  };
  // What is left is of second order: half the change leaves a quarter.
  EXPECT_GT(left_after(1), 1e-9);
  EXPECT_NEAR(left_after(0.5) / left_after(1), 0.25, 0.02);
  Motion far = some_motion();
  far.gyro_bias += Vec3(0.1, 0, 0);
  EXPECT_TRUE(link.stale(far));
}

TEST(ImuLink, HasTheRightDerivatives) {
  const ImuHistory imu = lively_imu();
  Motion from = some_motion();
  const ImuLink link(imu, 0.2, 0.6, from, noise);
  Motion to = from;
  propagate(to, imu, 0.2, 0.6, noise, nullptr);
  // The biases' own columns are to first order of what is left, so the motions agree.
  const auto j = link.jacobians(from, to);
  const auto moved = [](Motion m, const Eigen::VectorXd& by) {
    m.add(Vec15(by));
    return m;
  };
  EXPECT_TRUE(is_derivative(
      j.to_from, [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return link.residual(moved(from, d), to); }, 1e-6));
  EXPECT_TRUE(is_derivative(
      j.to_to, [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return link.residual(from, moved(to, d)); }, 1e-6));
}

TEST(ImuLink, ItsInformationIsThatOfTheNoise) {
  const ImuHistory imu = lively_imu();
  const Motion from = some_motion();
  const double dt = 0.2;
  const ImuLink link(imu, 0.1, 0.1 + dt, from, noise);
  const Mat15 covariance = link.information().inverse();
  EXPECT_NEAR(std::sqrt(covariance(at_theta, at_theta)), noise.gyro_density * std::sqrt(dt), 1e-7);
  EXPECT_NEAR(std::sqrt(covariance(at_gyro_bias, at_gyro_bias)), noise.gyro_random_walk * std::sqrt(dt), 1e-7);
  EXPECT_NEAR(std::sqrt(covariance(at_velocity, at_velocity)), noise.accel_density * std::sqrt(dt), 2e-4);
}

}  // namespace
}  // namespace takt::online
