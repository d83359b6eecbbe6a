// SPDX-License-Identifier: Apache-2.0
#include "takt/math/fourier.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace takt {
namespace {

TEST(Fourier, MaskedCorrelationEqualsTheDefinition) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> gauss;
  std::vector<double> a(57), b(80), ma(57, 1), mb(80, 1);
  for (double& x : a) x = 5 + gauss(random);
  for (double& x : b) x = -3 + gauss(random);
  for (std::size_t i = 10; i < 20; ++i) ma[i] = 0;
  for (std::size_t i = 33; i < 41; ++i) mb[i] = 0;
  const MaskedCorrelation c = masked_correlation(a, ma, b, mb, -1000, 1000, 10);
  EXPECT_EQ(c.first_lag, -56);
  ASSERT_EQ(c.r.size(), 56u + 80u);
  for (std::size_t i = 0; i < c.r.size(); ++i) {
    const std::ptrdiff_t lag = c.first_lag + static_cast<std::ptrdiff_t>(i);
    double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
    for (std::ptrdiff_t k = 0; k < 57; ++k) {
      const std::ptrdiff_t j = k + lag;
      if (j < 0 || j >= 80 || ma[k] == 0 || mb[j] == 0) continue;
      n += 1, sa += a[k], sb += b[j], saa += a[k] * a[k], sbb += b[j] * b[j], sab += a[k] * b[j];
    }
    EXPECT_EQ(c.pairs[i], n);
    const double r = n < 10 ? 0 : (sab - sa * sb / n) / std::sqrt((saa - sa * sa / n) * (sbb - sb * sb / n));
    EXPECT_NEAR(c.r[i], r, 1e-9) << lag;
  }
}

TEST(Fourier, ThereAndBack) {
  std::vector<double> x(64);
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = std::sin(0.3 * static_cast<double>(i)) + 0.1 * static_cast<double>(i);
  const auto back = from_spectrum(spectrum(x, 64), 64);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(back[i], x[i], 1e-12);
}

TEST(Fourier, MemoryOfWhiteSeriesIsOneSample) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> gauss;
  std::vector<double> a(4096), b(4096), ones(4096, 1);
  for (double& x : a) x = gauss(random);
  for (double& x : b) x = gauss(random);
  EXPECT_NEAR(masked_correlation(a, ones, b, ones, 0, 0, 3).memory, 1, 0.1);
}

}  // namespace
}  // namespace takt
