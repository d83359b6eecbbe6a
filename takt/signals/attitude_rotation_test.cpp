// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/attitude_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace takt {
namespace {

Quat turned(double t) {
  return exp_so3(Vec3(0.4 * std::sin(2 * t), 0.3 * std::sin(3 * t + 1), 0.5 * std::sin(t + 2)));
}

AttitudeStream poses(std::size_t n, double rate_hz, double sigma_rad) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> gauss;
  AttitudeStream out;
  out.name = "cori";
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    out.stamps.push_back(from_ns(5) + from_seconds(t));
    const Vec3 noise(gauss(random), gauss(random), gauss(random));
    out.world_from_body.push_back(turned(t) * exp_so3(sigma_rad * noise));
  }
  return out;
}

double normalised_error(const RotationSignal& signal) {
  double nees = 0;
  for (const RotationIncrement& r : signal.increments) {
    const double t0 = seconds_since(from_ns(5), r.from), t1 = seconds_since(from_ns(5), r.to);
    const Vec3 e = log_so3(exp_so3(r.rotation).conjugate() * turned(t0).conjugate() * turned(t1));
    nees += e.dot(r.information * e) / 3;
  }
  return nees / static_cast<double>(signal.increments.size());
}

TEST(AttitudeRotation, ErrorOverSigmaOfNoiseIsOne) {
  const RotationSignal signal = attitude_rotation(poses(2000, 60, 2e-4));
  ASSERT_EQ(signal.increments.size(), 1999u);
  EXPECT_TRUE(signal.notes.empty());
  // σ from the median of 6000 dependent differences: ±2 %.
  EXPECT_NEAR(normalised_error(signal), 1, 0.15);
}

TEST(AttitudeRotation, QuantisationIsNoiseToo) {
  AttitudeStream q15 = poses(2000, 60, 0);
  for (Quat& q : q15.world_from_body)
    for (int k = 0; k < 4; ++k) q.coeffs()[k] = std::round(q.coeffs()[k] * 32767) / 32767;
  const RotationSignal signal = attitude_rotation(q15);
  // Rounding of four components, then normalised: σ = 2·step/√12 about each axis.
  EXPECT_NEAR(normalised_error(signal), 1, 0.2);
}

TEST(AttitudeRotation, OldValuesWrittenAgainAreLeftOut) {
  AttitudeStream doubled = poses(400, 60, 0);
  for (std::size_t i = 1; i < 400; i += 2) doubled.world_from_body[i] = doubled.world_from_body[i - 1];
  const RotationSignal signal = attitude_rotation(doubled);
  EXPECT_EQ(signal.increments.size(), 199u);
  ASSERT_EQ(signal.notes.size(), 1u);
  EXPECT_EQ(signal.notes[0],
            "200 of 400 orientations repeat the one before them while it was turning and were left out");
}

TEST(AttitudeRotation, StillnessIsMeasuredNotLeftOut) {
  AttitudeStream still = poses(100, 60, 0);
  for (Quat& q : still.world_from_body) q = turned(0);
  const RotationSignal signal = attitude_rotation(still);
  EXPECT_EQ(signal.increments.size(), 99u);
  for (const RotationIncrement& r : signal.increments) EXPECT_LT(r.rotation.norm(), 1e-12);
}

TEST(AttitudeRotation, GapsAndBrokenValuesAreNotBridged) {
  AttitudeStream gappy = poses(100, 60, 0);
  for (std::size_t i = 50; i < 100; ++i) gappy.stamps[i] += from_seconds(1);
  gappy.world_from_body[20] = Quat(0, 0, 0, 0);
  gappy.stamps[30] = gappy.stamps[29];
  const RotationSignal signal = attitude_rotation(gappy);
  EXPECT_EQ(signal.increments.size(), 96u);
  EXPECT_EQ(signal.notes.size(), 2u);
}

}  // namespace
}  // namespace takt
