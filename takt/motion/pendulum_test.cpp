// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/pendulum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace takt {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double nanosecond = 1e-9;

PendulumModel rig() {
  return {.natural_rad_s = 4.2226, .viscous_per_s = 0.003, .coulomb_rad_s2 = 0.004, .quadratic_per_rad = 0.01};
}

TEST(Pendulum, UndampedPeriodIsTheEllipticIntegral) {
  for (const double swing : {0.05, 0.26, 1.2, 2.8}) {
    const double w0 = 4.2226;
    double a = 1, b = std::cos(swing / 2);  // arithmetic-geometric mean: T = 2π / (ω0·agm(1, cos θm/2))
    for (int i = 0; i < 8; ++i) {
      const double mean = 0.5 * (a + b);
      b = std::sqrt(a * b);
      a = mean;
    }
    const double half_period = pi / (w0 * a);
    const PendulumMotion motion({.natural_rad_s = w0}, swing, 0, 200);
    const auto& turns = motion.reversals();
    ASSERT_EQ(turns.size(), static_cast<std::size_t>(200 / half_period)) << swing;
    EXPECT_NEAR(turns.back(), half_period * static_cast<double>(turns.size()), nanosecond) << swing;
  }
}

TEST(Pendulum, SmallSwingsAreTheDampedSine) {
  // At 1e-6 rad the difference of sin θ and θ is worth 1e-11 s over 200 s.
  const double w0 = 4.2226, delta = 0.01, swing = 1e-6;
  const double w = std::sqrt(w0 * w0 - delta * delta);
  const PendulumMotion motion({.natural_rad_s = w0, .viscous_per_s = delta}, swing, 0, 200);
  for (double t = 0; t < 200; t += 0.37) {
    const double angle = swing * std::exp(-delta * t) * (std::cos(w * t) + delta / w * std::sin(w * t));
    const double rate = -swing * std::exp(-delta * t) * w0 * w0 / w * std::sin(w * t);
    const double fastest = swing * w0 * std::exp(-delta * t);
    EXPECT_NEAR(motion.at(t).angle, angle, fastest * nanosecond);
    EXPECT_NEAR(motion.at(t).rate, rate, fastest * w0 * nanosecond);
  }
}

TEST(Pendulum, DryFrictionTakesAFixedStepFromEachSwingAndHoldsInTheEnd) {
  // Linear oscillator with μ: each half swing lasts π/ω0 and loses 2μ/ω0²; it stands where ω0²·|θ| ≤ μ.
  const double w0 = 2, swing = 1.05e-6, mu = 0.4e-6, step = 2 * mu / (w0 * w0);
  const PendulumMotion motion({.natural_rad_s = w0, .coulomb_rad_s2 = mu}, swing, 0, 60);
  const auto& turns = motion.reversals();
  ASSERT_EQ(turns.size(), 5u);  // 1.05 −0.85 0.65 −0.45 0.25 −0.05: |−0.05|·4 < 0.4 holds
  double amplitude = swing;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    amplitude -= step;
    EXPECT_NEAR(turns[i], pi / w0 * static_cast<double>(i + 1), nanosecond);
    EXPECT_NEAR(std::abs(motion.at(turns[i]).angle), amplitude, 1e-15);
  }
  EXPECT_EQ(motion.at(59).rate, 0);
  EXPECT_EQ(motion.at(59).angle, motion.at(turns.back() + 1e-6).angle);
}

TEST(Pendulum, HalvingTheStepChangesNothing) {
  const PendulumMotion coarse(rig(), 0.27, 0, 200, 0.25), fine(rig(), 0.27, 0, 200, 0.06);
  ASSERT_EQ(coarse.reversals().size(), fine.reversals().size());
  for (std::size_t i = 0; i < coarse.reversals().size(); ++i)
    EXPECT_NEAR(coarse.reversals()[i], fine.reversals()[i], nanosecond);
}

TEST(Pendulum, AccelerationObeysTheEquation) {
  const PendulumModel m = rig();
  const PendulumMotion motion(m, 0.27, 0, 50);
  for (double t = 0.01; t < 50; t += 0.173) {
    const PendulumState s = motion.at(t);
    const double expected = -m.natural_rad_s * m.natural_rad_s * std::sin(s.angle) - 2 * m.viscous_per_s * s.rate -
                            std::copysign(m.coulomb_rad_s2, s.rate) - m.quadratic_per_rad * std::abs(s.rate) * s.rate;
    EXPECT_NEAR(s.acceleration, expected, 1e-11);
  }
}

TEST(Pendulum, MeanAngleIsTheIntegral) {
  const PendulumMotion motion(rig(), 0.27, 0, 20);
  for (double from = 0.1; from < 19; from += 0.31) {
    double sum = 0;
    const int n = 2000;
    for (int i = 0; i < n; ++i) sum += motion.at(from + 0.4 * (i + 0.5) / n).angle;
    EXPECT_NEAR(motion.mean_angle(from, from + 0.4), sum / n, 2e-8);
    EXPECT_NEAR(motion.mean_angle(from, from + 0.002), motion.at(from + 0.001).angle, 2e-6);
  }
}

TEST(Pendulum, NonsenseIsRefused) {
  EXPECT_THROW(PendulumMotion({.natural_rad_s = 0}, 0.1, 0, 1), std::invalid_argument);
  EXPECT_THROW(PendulumMotion({.viscous_per_s = -1}, 0.1, 0, 1), std::invalid_argument);
  const PendulumMotion short_one({}, 0.1, 0, 1);
  EXPECT_THROW(static_cast<void>(short_one.at(2)), std::out_of_range);
}

}  // namespace
}  // namespace takt
