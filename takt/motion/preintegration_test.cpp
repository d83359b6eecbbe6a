// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/preintegration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "takt/math/check_derivative.h"
#include "takt/motion/trajectory.h"

namespace takt {
namespace {

constexpr ImuDensity noise{1.7e-4, 2e-3};
const Vec3 gyro_bias(0.02, -0.01, 0.015), accel_bias(-0.1, 0.05, 0.2);

/// A shaken body: about 2 rad/s and 3 m/s², up to 3 Hz.
class Shaken : public Trajectory {
 public:
  Eigen::Isometry3d world_from_body(double t) const override {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = exp_so3(phi(t)).toRotationMatrix();
    pose.translation() = Vec3(0.1 * std::sin(5 * t), 0.05 * std::cos(7 * t), 0.03 * std::sin(13 * t + 1));
    return pose;
  }
  Vec3 omega_body(double t) const override {
    const Vec3 slope(0.3 * 6 * std::cos(6 * t), -0.2 * 9 * std::sin(9 * t), 0.1 * 17 * std::cos(17 * t));
    return right_jacobian(phi(t)) * slope;
  }
  Vec3 velocity_world(double t) const override {
    return {0.5 * std::cos(5 * t), -0.35 * std::sin(7 * t), 0.39 * std::cos(13 * t + 1)};
  }
  Vec3 acceleration_world(double t) const override {
    return {-2.5 * std::sin(5 * t), -2.45 * std::cos(7 * t), -5.07 * std::sin(13 * t + 1)};
  }

 private:
  static Vec3 phi(double t) { return {0.3 * std::sin(6 * t), 0.2 * std::cos(9 * t), 0.1 * std::sin(17 * t)}; }
};

ImuCurve sampled(double rate_hz, std::mt19937* random = nullptr) {
  const Shaken truth;
  std::normal_distribution<double> normal;
  const auto white = [&](double density) {
    if (!random) return Vec3(Vec3::Zero());
    const double x = normal(*random), y = normal(*random), z = normal(*random);
    return Vec3(density * std::sqrt(rate_hz) * Vec3(x, y, z));
  };
  std::vector<double> t;
  std::vector<Vec3> gyro, accel;
  for (int i = 0; i <= rate_hz; ++i) {
    t.push_back(i / rate_hz);
    gyro.push_back(truth.omega_body(t.back()) + gyro_bias + white(noise.gyro));
    accel.push_back(truth.specific_force_body(t.back()) + accel_bias + white(noise.accel));
  }
  return {t, gyro, accel};
}

using Increment = Eigen::Matrix<double, 9, 1>;

/// What separates two increments, in the tangent space of the first.
Increment difference(const Preintegrated& a, const Preintegrated& b) {
  Increment d;
  d << log_so3(a.rotation.conjugate() * b.rotation), b.velocity - a.velocity, b.position - a.position;
  return d;
}

TEST(Preintegration, GivesBackTheMotion) {
  const Shaken truth;
  const ImuCurve curve = sampled(200);
  for (const auto& [t0, t1] : {std::pair(0.1, 0.15), std::pair(0.1234, 0.1872), std::pair(0.3, 0.9)}) {
    const Preintegrated found = preintegrate(curve, t0, t1, gyro_bias, accel_bias, noise);
    const auto from = truth.world_from_body(t0), to = truth.world_from_body(t1);
    const Mat3 back = from.linear().transpose();
    const double dt = t1 - t0;
    const Vec3 v0 = truth.velocity_world(t0), g = gravity_world();
    EXPECT_LT(log_so3(found.rotation.conjugate() * Quat(back * to.linear())).norm(), 1e-6);
    EXPECT_LT((found.velocity - back * (truth.velocity_world(t1) - v0 - dt * g)).norm(), 2e-5);
    EXPECT_LT((found.position - back * (to.translation() - from.translation() - dt * v0 - 0.5 * dt * dt * g)).norm(),
              1e-5);
  }
}

TEST(Preintegration, TheErrorFallsWithThirdPowerOfTheRateAtLeast) {
  const Shaken truth;
  const auto error = [&](double rate_hz) {
    const Preintegrated found = preintegrate(sampled(rate_hz), 0.3, 0.7, gyro_bias, accel_bias, noise);
    const auto from = truth.world_from_body(0.3), to = truth.world_from_body(0.7);
    const Mat3 back = from.linear().transpose();
    return log_so3(found.rotation.conjugate() * Quat(back * to.linear())).norm() +
           (found.velocity - back * (truth.velocity_world(0.7) - truth.velocity_world(0.3) - 0.4 * gravity_world()))
               .norm();
  };
  EXPECT_LT(error(200), error(50) / 64);
}

TEST(Preintegration, TwoIntervalsMakeOne) {
  const ImuCurve curve = sampled(200);
  const auto piece = [&](double t0, double t1) { return preintegrate(curve, t0, t1, gyro_bias, accel_bias, noise); };
  const Preintegrated whole = piece(0.2, 0.3), first = piece(0.2, 0.241), second = piece(0.241, 0.3);
  Preintegrated joined;
  joined.rotation = first.rotation * second.rotation;
  joined.velocity = first.velocity + first.rotation * second.velocity;
  joined.position = first.position + second.duration_s * first.velocity + first.rotation * second.position;
  EXPECT_LT(difference(whole, joined).norm(), 1e-7);
}

TEST(Preintegration, DerivativesToTheBiases) {
  const ImuCurve curve = sampled(200);
  const double t0 = 0.1234, t1 = 0.1872;
  const Preintegrated at = preintegrate(curve, t0, t1, gyro_bias, accel_bias, noise);
  Eigen::Matrix<double, 9, 6> jacobian;
  jacobian << at.rotation_to_gyro, Mat3::Zero(), at.velocity_to_gyro, at.velocity_to_accel, at.position_to_gyro,
      at.position_to_accel;
  const auto moved = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return difference(at, preintegrate(curve, t0, t1, gyro_bias + d.head<3>(), accel_bias + d.tail<3>(), noise));
  };
  EXPECT_TRUE(is_derivative(jacobian, moved, 1e-6));
}

TEST(Preintegration, DerivativesToTheEnds) {
  const ImuCurve curve = sampled(200);
  const double t0 = 0.1234, t1 = 0.1872;
  const Preintegrated at = preintegrate(curve, t0, t1, gyro_bias, accel_bias, noise);
  Eigen::Matrix<double, 9, 2> jacobian;
  jacobian << at.to_start.rotation, at.to_end.rotation, at.to_start.velocity, at.to_end.velocity, at.to_start.position,
      at.to_end.position;
  const auto moved = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return difference(at, preintegrate(curve, t0 + d[0], t1 + d[1], gyro_bias, accel_bias, noise));
  };
  // The quadrature is of third order, so the derivative of its result is that of the integral but for its own error.
  EXPECT_TRUE(is_derivative(jacobian, moved, 2e-5, 1e-3));
}

TEST(Preintegration, TheCovarianceIsThatOfTheNoise) {
  // Over 20 whole sample intervals, so that the samples' weights are those of the white noise's integral.
  constexpr int runs = 400;
  const double t0 = 0.2, t1 = 0.3;
  const Preintegrated mean = preintegrate(sampled(200), t0, t1, gyro_bias, accel_bias, noise);
  std::mt19937 random(1);
  Mat9 scatter = Mat9::Zero();
  for (int i = 0; i < runs; ++i) {
    const Increment d = difference(mean, preintegrate(sampled(200, &random), t0, t1, gyro_bias, accel_bias, noise));
    scatter += d * d.transpose() / runs;
  }
  // Whitened by what is claimed, the scatter is the identity within its own sampling error, √(2/runs) = 0.07 on the
  // diagonal; the two half samples at the ends take up to 3 % off.
  const Mat9 root = mean.covariance.llt().matrixL().solve(Mat9::Identity());
  const Mat9 whitened = root * scatter * root.transpose();
  EXPECT_LT((whitened - Mat9::Identity()).cwiseAbs().maxCoeff(), 0.28) << whitened;
}

TEST(Preintegration, AnIntervalOutsideTheSamplesIsTheCallersFault) {
  const ImuCurve curve = sampled(200);
  EXPECT_THROW((void)preintegrate(curve, 0.5, 1.5, gyro_bias, accel_bias, noise), std::invalid_argument);
  EXPECT_THROW((void)preintegrate(curve, 0.5, 0.4, gyro_bias, accel_bias, noise), std::invalid_argument);
}

}  // namespace
}  // namespace takt
