// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/gyro_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace takt {
namespace {

/// Attitude of a hand-held device and its rate by central difference, exact to 1e-9 rad/s.
Quat attitude(double t) {
  return exp_so3(Vec3(0.4 * std::sin(7 * t), 0.3 * std::sin(11 * t + 1), 0.5 * std::sin(5 * t + 2)));
}
Vec3 rate(double t) {
  constexpr double h = 1e-4;
  return (8 * log_so3(attitude(t - h).conjugate() * attitude(t + h)) -
          log_so3(attitude(t - 2 * h).conjugate() * attitude(t + 2 * h))) /
         (12 * h);
}

ImuStream sampled(double rate_hz, double seconds, double noise_rad_s, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  ImuStream gyro;
  gyro.name = "imu1";
  const auto n = static_cast<std::size_t>(seconds * rate_hz);
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    gyro.stamps.push_back(from_ns(1'700'000'000'000'000'000) + from_seconds(t));
    gyro.gyro_rad_s.push_back(rate(t) + noise_rad_s * Vec3(gauss(random), gauss(random), gauss(random)));
  }
  return gyro;
}

Vec3 error_of(const RotationIncrement& r, Stamp epoch) {
  const double t0 = seconds_since(epoch, r.from), t1 = seconds_since(epoch, r.to);
  return log_so3(exp_so3(r.rotation).conjugate() * attitude(t0).conjugate() * attitude(t1));
}

TEST(GyroRotation, IntegratesExactlyBetweenScatteredEdges) {
  const ImuStream gyro = sampled(400, 20, 0);
  const RotationSignal signal = gyro_rotation(gyro);
  ASSERT_GT(signal.increments.size(), 400u);
  std::size_t off_grid = 0;
  for (std::size_t i = 0; i < signal.increments.size(); ++i) {
    const RotationIncrement& r = signal.increments[i];
    if (i > 0) {
      EXPECT_EQ(r.from, signal.increments[i - 1].to);
    }
    // The natural spline's ends are the worst place: 1e-6 rad holds there too.
    EXPECT_LT(error_of(r, gyro.stamps[0]).norm(), 1e-6) << i;
    if (std::abs(std::remainder(to_seconds(r.from - gyro.stamps[0]), 1 / 400.0)) > 1e-4) ++off_grid;
  }
  EXPECT_GT(off_grid, signal.increments.size() * 8 / 10);
}

TEST(GyroRotation, ErrorOverSigmaIsOne) {
  const ImuStream gyro = sampled(200, 120, 0.01);
  const RotationSignal signal = gyro_rotation(gyro);
  double nees = 0;
  for (const RotationIncrement& r : signal.increments) {
    const Vec3 e = error_of(r, gyro.stamps[0]);
    nees += e.dot(r.information * e) / 3;
  }
  const auto n = static_cast<double>(signal.increments.size());
  // The spline weighs samples near an edge by a little more than its share: a few percent of the variance of a bin.
  EXPECT_NEAR(nees / n, 1, 0.1 + 4 * std::sqrt(2 / (3 * n)));
}

TEST(GyroRotation, NoBinSpansAGapAndItIsNoted) {
  ImuStream gyro = sampled(400, 4, 0);
  gyro.stamps.erase(gyro.stamps.begin() + 800, gyro.stamps.begin() + 900);
  gyro.gyro_rad_s.erase(gyro.gyro_rad_s.begin() + 800, gyro.gyro_rad_s.begin() + 900);
  const RotationSignal signal = gyro_rotation(gyro);
  const Stamp before = gyro.stamps[799], after = gyro.stamps[800];
  for (const RotationIncrement& r : signal.increments) EXPECT_TRUE(r.to <= before || r.from >= after);
  EXPECT_EQ(signal.notes[0], "1 gaps in the samples are not bridged");
}

TEST(GyroRotation, BackwardAndBrokenSamplesAreLeftOut) {
  ImuStream gyro = sampled(400, 4, 0);
  gyro.stamps[100] = gyro.stamps[90];
  gyro.gyro_rad_s[200].x() = std::nan("");
  const RotationSignal signal = gyro_rotation(gyro);
  EXPECT_EQ(signal.notes[0], "2 of 1600 samples do not advance in time or are not finite and were left out");
  for (const RotationIncrement& r : signal.increments) EXPECT_LT(error_of(r, gyro.stamps[0]).norm(), 1e-4);
}

TEST(GyroRotation, BinsAreShortAgainstTheMotion) {
  const auto wobble = [](double hz) {
    ImuStream gyro;
    for (int i = 0; i < 8000; ++i) {
      const double t = i / 400.0;
      gyro.stamps.push_back(from_ns(0) + from_seconds(t));
      gyro.gyro_rad_s.emplace_back(std::sin(2 * std::numbers::pi * hz * t), 0, 0);
    }
    return gyro;
  };
  EXPECT_NEAR(motion_bandwidth_hz(wobble(3)), 3, 1);
  EXPECT_NEAR(motion_bandwidth_hz(wobble(25)), 25, 1);
  const auto longest_bin_s = [](const RotationSignal& s) {
    double longest = 0;
    for (const auto& r : s.increments) longest = std::max(longest, to_seconds(r.to - r.from));
    return longest;
  };
  EXPECT_LT(longest_bin_s(gyro_rotation(wobble(3))), 0.015 + 0.0026);       // six samples
  EXPECT_LT(longest_bin_s(gyro_rotation(wobble(25))), 1 / 150.0 + 0.0026);  // a sixth of a period
}

TEST(GyroRotation, TooFewSamplesAreTheCallersMistake) {
  EXPECT_THROW((void)gyro_rotation(sampled(400, 0.01, 0)), std::invalid_argument);
  ImuStream uneven = sampled(400, 1, 0);
  uneven.gyro_rad_s.pop_back();
  EXPECT_THROW((void)gyro_rotation(uneven), std::invalid_argument);
}

}  // namespace
}  // namespace takt
