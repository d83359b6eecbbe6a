// SPDX-License-Identifier: Apache-2.0
#include "takt/math/arma.h"

#include <gtest/gtest.h>

#include <random>

namespace takt {
namespace {

std::vector<double> simulate(const Arma11& m, std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  std::vector<double> out;
  double u = 0, e = gauss(random);
  for (std::size_t i = 0; i < n + 200; ++i) {
    const double next = gauss(random);
    u = m.ar * u + next + m.ma * e;
    e = next;
    if (i >= 200) out.push_back(u);
  }
  return out;
}

TEST(Arma, WhitensToUnitVarianceWithoutCorrelation) {
  for (const Arma11 m : {Arma11{0, -0.9}, Arma11{0.8, 0}, Arma11{0.9, -0.5}, Arma11{0, 0}}) {
    const auto u = simulate(m, 20000, 1);
    Whitener<double> whiten(m);
    double sum = 0, lag = 0, before = 0;
    for (const double x : u) {
      const double e = whiten(x);
      sum += e * e;
      lag += e * before;
      before = e;
    }
    EXPECT_NEAR(sum / 20000, 1, 4 * std::sqrt(2.0 / 20000));
    EXPECT_NEAR(lag / 20000, 0, 4 / std::sqrt(20000.0));
  }
}

TEST(Arma, FitFindsTheModel) {
  for (const Arma11 m : {Arma11{0, -0.9}, Arma11{0.8, 0}, Arma11{0.9, -0.5}}) {
    const std::vector<std::vector<double>> stretches{simulate(m, 6000, 2), simulate(m, 6000, 3)};
    const Arma11 found = fit_arma11(stretches);
    EXPECT_NEAR(found.ar, m.ar, 0.06);
    EXPECT_NEAR(found.ma, m.ma, 0.06);
  }
}

TEST(Arma, FirstSampleHasTheStationaryVariance) {
  const Arma11 m{0.5, -0.8};
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    Whitener<double> whiten(m);
    const double e = whiten(simulate(m, 1, seed).front());
    sum += e * e;
  }
  EXPECT_NEAR(sum / 4000, 1, 4 * std::sqrt(2.0 / 4000));
}

}  // namespace
}  // namespace takt
