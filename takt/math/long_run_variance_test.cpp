// SPDX-License-Identifier: Apache-2.0
#include "takt/math/long_run_variance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace takt {
namespace {

/// White noise of unit density through two one-pole sections, then means of `n`: the density at zero stays 1,
/// so a slow mean over N outputs has the variance 1/(N·n).
std::vector<double> filtered(double pole, int n, int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> out;
  double first = 0, second = 0;
  for (int i = 0; i < count; ++i) {
    double sum = 0;
    for (int k = 0; k < n; ++k) {
      first += (1 - pole) * (normal(random) - first);
      second += (1 - pole) * (first - second);
      sum += second;
    }
    out.push_back(sum / n);
  }
  return out;
}

TEST(LongRunVariance, SeesThroughTheLowPass) {
  for (const double pole : {0.0, 0.59, 0.75})
    for (const int n : {1, 2, 5}) {
      const auto x = filtered(pole, n, 30000, 3);
      // The estimate of an order-p spectrum scatters by √(4p/N), 4 % for p = 12: four of them.
      EXPECT_NEAR(long_run_variance(x) * n, 1, 0.16) << pole << ", means of " << n;
    }
}

TEST(LongRunVariance, WhiteNoiseIsItsSampleVariance) {
  const auto x = filtered(0, 1, 30000, 5);
  double squares = 0;
  for (const double v : x) squares += v * v / 30000;
  EXPECT_NEAR(long_run_variance(x) / squares, 1, 0.1);
}

TEST(LongRunVariance, GivesBackWhatASmoothFitTook) {
  // Means over blocks of 25 stand for the fit: it takes one degree of freedom of every 25.
  for (const double pole : {0.0, 0.59}) {
    auto x = filtered(pole, 1, 60000, 7);
    for (std::size_t i = 0; i < x.size(); i += 25) {
      double mean = 0;
      for (std::size_t k = i; k < i + 25; ++k) mean += x[k] / 25;
      for (std::size_t k = i; k < i + 25; ++k) x[k] -= mean;
    }
    const double taken = long_run_variance(x, 3), whole = long_run_variance(x, 3, 60000 / 25);
    EXPECT_LT(taken, 0.85) << pole;
    EXPECT_NEAR(whole, 1, 0.12) << pole;
  }
}

TEST(LongRunVariance, ConstantAndShortSeries) {
  EXPECT_NEAR(long_run_variance(std::vector<double>(50, 2.5)), 0, 1e-20);
  EXPECT_THROW(static_cast<void>(long_run_variance(std::vector<double>(5, 1.0))), std::invalid_argument);
}

}  // namespace
}  // namespace takt
