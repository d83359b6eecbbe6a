// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/gyro_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace takt {
namespace {

/// A coning motion with a closed form: R(t) = exp(a·ẑ·t)·exp(b·x̂): ω_body = exp(−b·x̂)·(a·ẑ), plus a spin about z.
struct Wobble {
  static Quat attitude(double t) {
    return exp_so3(Vec3(0, 0, 0.8 * std::sin(3 * t))) * exp_so3(Vec3(0.5 * std::sin(5 * t), 0, 0));
  }
  static Vec3 rate(double t) {
    const Quat second = exp_so3(Vec3(0.5 * std::sin(5 * t), 0, 0));
    return second.conjugate() * Vec3(0, 0, 2.4 * std::cos(3 * t)) + Vec3(2.5 * std::cos(5 * t), 0, 0);
  }
};

GyroCurve sampled(double rate_hz, double duration_s) {
  std::vector<double> t;
  std::vector<Vec3> w;
  for (int i = 0; i <= duration_s * rate_hz; ++i) {
    t.push_back(i / rate_hz);
    w.push_back(Wobble::rate(t.back()));
  }
  return {t, w};
}

TEST(GyroCurve, FollowsAClosedFormMotion) {
  const GyroCurve curve = sampled(200, 10);
  double worst = 0;
  // The natural end condition costs some samples at either end.
  for (double t = 0.5; t < 9; t += 0.0137) {
    const Quat truth = Wobble::attitude(t).conjugate() * Wobble::attitude(t + 0.05);
    worst = std::max(worst, log_so3(truth.conjugate() * curve.between(t, t + 0.05)).norm());
    EXPECT_LT((curve.rate(t) - Wobble::rate(t)).norm(), 2e-6);
    const Vec3 slope = (Wobble::rate(t + 1e-5) - Wobble::rate(t - 1e-5)) / 2e-5;
    EXPECT_LT((curve.rate_slope(t) - slope).norm(), 2e-3);
  }
  EXPECT_LT(worst, 2e-9);
}

TEST(GyroCurve, ErrorFallsWithTheFourthPowerOfTheStep) {
  const auto error = [](double rate_hz) {
    const GyroCurve curve = sampled(rate_hz, 4);
    const Quat truth = Wobble::attitude(1.0).conjugate() * Wobble::attitude(3.0);
    return log_so3(truth.conjugate() * curve.between(1.0, 3.0)).norm();
  };
  EXPECT_GT(error(50) / error(100), 10);
}

TEST(GyroCurve, BreaksAtGapsAndSaysSo) {
  std::vector<double> t;
  std::vector<Vec3> w;
  for (int i = 0; i < 100; ++i)
    if (i < 40 || i >= 60) {
      t.push_back(i * 0.01);
      w.emplace_back(1, 2, 3);
    }
  const GyroCurve curve(t, w);
  EXPECT_EQ(curve.gaps(), 1u);
  EXPECT_TRUE(curve.covers(0.0, 0.39));
  EXPECT_TRUE(curve.covers(0.6, 0.99));
  EXPECT_FALSE(curve.covers(0.3, 0.7));
  EXPECT_FALSE(curve.covers(0.45, 0.5));
  EXPECT_FALSE(curve.covers(-0.1, 0.2));
  EXPECT_FALSE(curve.covers(0.9, 1.2));
  EXPECT_THROW((void)curve.rate(2.0), std::out_of_range);
}

TEST(GyroCurve, MeasuresItsNoiseBeneathTheMotion) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> gauss;
  std::vector<double> t;
  std::vector<Vec3> w;
  for (int i = 0; i < 4000; ++i) {
    t.push_back(i / 200.0);
    w.push_back(Wobble::rate(t.back()) + 2e-3 * Vec3(gauss(random), gauss(random), gauss(random)));
  }
  // 12000 magnitudes correlated over 7 samples: the median's spread is about 2 %.
  EXPECT_NEAR(GyroCurve(t, w).noise_density(), 2e-3 / std::sqrt(200.0), 0.1 * 2e-3 / std::sqrt(200.0));
}

TEST(GyroCurve, RefusesBrokenInput) {
  EXPECT_THROW(GyroCurve({0.0}, {Vec3::Zero()}), std::invalid_argument);
  EXPECT_THROW(GyroCurve({0.0, 0.0}, {Vec3::Zero(), Vec3::Zero()}), std::invalid_argument);
  EXPECT_THROW(GyroCurve({0.0, 1.0}, {Vec3::Zero(), Vec3(NAN, 0, 0)}), std::invalid_argument);
}

}  // namespace
}  // namespace takt
