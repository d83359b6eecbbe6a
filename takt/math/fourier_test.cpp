// SPDX-License-Identifier: Apache-2.0
#include "takt/math/fourier.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <random>

namespace takt {
namespace {

MaskedVectors noise(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  MaskedVectors x;
  for (std::size_t i = 0; i < n; ++i) x.value.emplace_back(gauss(random), gauss(random), gauss(random));
  x.valid.assign(n, 1.0);
  return x;
}

TEST(Fourier, VectorCorrelationEqualsTheDefinition) {
  MaskedVectors a = noise(57, 1), b = noise(80, 2);
  for (std::size_t i = 10; i < 20; ++i) a.valid[i] = 0;
  for (std::size_t i = 33; i < 41; ++i) b.valid[i] = 0;
  const VectorCorrelation c = vector_correlation(a, b, -1000, 1000, 10);
  EXPECT_EQ(c.first_lag, -56);
  ASSERT_EQ(c.r.size(), 56u + 80u);
  const auto mean = [](const MaskedVectors& x) {
    Eigen::Vector3d m = Eigen::Vector3d::Zero();
    double n = 0;
    for (std::size_t i = 0; i < x.value.size(); ++i) m += x.valid[i] * x.value[i], n += x.valid[i];
    return Eigen::Vector3d(m / n);
  };
  const Eigen::Vector3d ma = mean(a), mb = mean(b);
  for (std::size_t i = 0; i < c.r.size(); ++i) {
    const std::ptrdiff_t lag = c.first_lag + static_cast<std::ptrdiff_t>(i);
    double n = 0, aa = 0, bb = 0;
    Eigen::Matrix3d ab = Eigen::Matrix3d::Zero();
    for (std::ptrdiff_t k = 0; k < 57; ++k) {
      const std::ptrdiff_t j = k + lag;
      if (j < 0 || j >= 80 || a.valid[k] == 0 || b.valid[j] == 0) continue;
      n += 1, aa += (a.value[k] - ma).squaredNorm(), bb += (b.value[j] - mb).squaredNorm();
      ab += (b.value[j] - mb) * (a.value[k] - ma).transpose();
    }
    EXPECT_EQ(c.pairs[i], n);
    const Eigen::Vector3d s = Eigen::JacobiSVD<Eigen::Matrix3d>(ab).singularValues();
    const double match = s[0] + s[1] + (ab.determinant() < 0 ? -s[2] : s[2]);
    EXPECT_NEAR(c.r[i], n < 10 ? 0 : match / std::sqrt(aa * bb), 1e-7) << lag;
  }
}

TEST(Fourier, ARotatedCopyCorrelatesFullyAtItsLagAlone) {
  const MaskedVectors a = noise(500, 3);
  MaskedVectors b = noise(600, 4);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (std::size_t i = 0; i < 500; ++i) b.value[i + 70] = turn * a.value[i];
  const VectorCorrelation c = vector_correlation(a, b, -400, 500, 50);
  for (std::size_t i = 0; i < c.r.size(); ++i) {
    const std::ptrdiff_t lag = c.first_lag + static_cast<std::ptrdiff_t>(i);
    // Means over the whole differ a little from those over the pairs.
    if (lag == 70)
      EXPECT_GT(c.r[i], 0.99);
    else
      EXPECT_LT(c.r[i], 0.6);
  }
}

TEST(Fourier, ThereAndBack) {
  std::vector<double> x(64);
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = std::sin(0.3 * static_cast<double>(i)) + 0.1 * static_cast<double>(i);
  const auto back = from_spectrum(spectrum(x, 64), 64);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(back[i], x[i], 1e-12);
}

TEST(Fourier, MemoryOfWhiteSeriesIsOneSampleAndItsAxesAreThree) {
  const VectorCorrelation c = vector_correlation(noise(4096, 5), noise(4096, 6), 0, 0, 3);
  EXPECT_NEAR(c.memory, 1, 0.1);
  EXPECT_NEAR(c.axes, 3, 0.1);
}

}  // namespace
}  // namespace takt
