// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/wave.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace takt {
namespace {

const Band shaky{.rms = 1.2, .low_hz = 0.3, .high_hz = 4, .tones = 24};

Wave wave(const Band& band, std::uint64_t seed) {
  return Wave(band, Mat3::Identity(), Random(seed, "test"));
}

TEST(Wave, DerivativesMatchNumericDifferences) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Wave w = wave(shaky, seed);
    const double h = 1e-5;
    for (double t = -7; t < 20; t += 0.731) {
      const Vec3 first = (w.at(t + h)[0] - w.at(t - h)[0]) / (2 * h);
      const Vec3 second = (w.at(t + h)[1] - w.at(t - h)[1]) / (2 * h);
      EXPECT_LT((w.at(t)[1] - first).norm(), 1e-7) << t;
      EXPECT_LT((w.at(t)[2] - second).norm(), 1e-5) << t;
    }
  }
}

TEST(Wave, IsSmoothAcrossTheKnotsOfItsEnvelope) {
  const Wave w = wave(shaky, 1);
  for (const double knot : {-3.0, 0.0, 3.0, 6.0})
    for (std::size_t d = 0; d < 3; ++d) EXPECT_LT((w.at(knot + 1e-9)[d] - w.at(knot - 1e-9)[d]).norm(), 1e-6);
}

TEST(Wave, ItsRateHasTheAskedRms) {
  // 4000 s hold some 1300 envelope knots times 24 tones: the mean square is known to about 1.5 %.
  const Wave w = wave(shaky, 5);
  double sum = 0;
  int n = 0;
  for (double t = 0; t < 4000; t += 0.0917, ++n) sum += w.at(t)[1].squaredNorm();
  EXPECT_NEAR(std::sqrt(sum / n), shaky.rms, 0.05 * shaky.rms);
}

TEST(Wave, StaysWithinItsBound) {
  const Wave w = wave(shaky, 6);
  const Vec3 bound = w.bound();
  for (double t = 0; t < 300; t += 0.05) EXPECT_TRUE((w.at(t)[0].array().abs() <= bound.array()).all());
}

TEST(Wave, ASingleToneIsAPureSinusoid) {
  const Wave w = wave({.rms = 1, .low_hz = 1.25, .high_hz = 1.25, .tones = 1}, 9);
  for (double t = 0; t < 30; t += 0.37) EXPECT_LT((w.at(t)[0] - w.at(t + 0.8)[0]).norm(), 1e-12);
}

TEST(Wave, NeverRepeatsItself) {
  // The correlation of the rate with itself, far from lag zero: 60 s windows hold about 2·4 Hz·60 s ≈ 400 independent
  // values, so a chance correlation has σ ≈ 0.05, and among 6000 lags 10σ is out of reach.
  const Wave w = wave(shaky, 7);
  std::vector<Vec3> rate;
  for (int i = 0; i < 1620 * 20; ++i) rate.push_back(w.at(0.05 * i)[1]);
  const std::size_t window = 60 * 20;
  const auto correlate = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t i = 0; i < window; ++i) sum += rate[i].dot(rate[i + lag]);
    return sum;
  };
  double worst = 0;
  for (std::size_t lag = window; lag + window <= rate.size(); lag += 5)
    worst = std::max(worst, std::abs(correlate(lag)) / correlate(0));
  EXPECT_LT(worst, 0.5);
}

TEST(Wave, SeedsDiffer) {
  EXPECT_GT((wave(shaky, 1).at(1)[1] - wave(shaky, 2).at(1)[1]).norm(), 1e-3);
}

TEST(Wave, RefusesAnEmptyBand) {
  EXPECT_THROW(wave({.rms = 1, .low_hz = 2, .high_hz = 1}, 1), std::invalid_argument);
  EXPECT_THROW(wave({.rms = -1}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace takt
