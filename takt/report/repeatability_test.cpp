// SPDX-License-Identifier: Apache-2.0
#include "takt/report/repeatability.h"

#include <gtest/gtest.h>

#include <random>

namespace takt {
namespace {

Estimate answer(double offset_s, double sigma_s, double day = 0, std::optional<double> temperature_c = std::nullopt) {
  Estimate e;
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = from_seconds(offset_s);
  e.sigma_s = sigma_s;
  e.epoch = from_ns(1'700'000'000'000'000'000 + static_cast<std::int64_t>(day * 86400e9));
  if (temperature_c) e.extras.push_back({"temperature_c", *temperature_c, std::nullopt});
  return e;
}

TEST(Repeatability, OneFarAnswerIsNamedAndUncertainOnesAreNot) {
  std::vector<Estimate> results;
  for (const double x : {3.10, 3.11, 3.09, 3.12, 3.10, 3.08}) results.push_back(answer(x * 1e-3, 1e-5));
  results.push_back(answer(3.9e-3, 1e-5));
  results.push_back(answer(3.9e-3, 5e-4));  // as far, but it says so
  const auto r = repeatability(results);
  ASSERT_EQ(r.size(), 1u);
  EXPECT_EQ(r[0].outliers, std::vector<std::size_t>{6});
  EXPECT_NE(in_words(r[0], {"a", "b", "c", "d", "e", "f", "g", "h"}).find("far from the others: g"), std::string::npos);
  EXPECT_NE(in_words(r[0]).find("far from the others: result 7"), std::string::npos);
}

TEST(Repeatability, ATrendIsFoundWithItsSigmaAndChanceIsNot) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1e-5);
  int found = 0, by_chance = 0, of_four_by_chance = 0;
  double squares = 0;
  constexpr int runs = 400;
  for (int run = 0; run < runs; ++run) {
    std::vector<Estimate> warm, steady;
    for (int i = 0; i < 12; ++i) {
      warm.push_back(answer(3e-3 + 1e-5 * i + noise(random), 1e-5, 0, 25 + 2 * i));
      steady.push_back(answer(3e-3 + noise(random), 1e-5, i));
    }
    const Trend t = repeatability(warm)[0].trends.at(0);  // all on one day, so this is the temperature's
    EXPECT_EQ(t.against, "temperature");
    found += t.significant();
    squares += std::pow((t.slope_s - 5e-6) / t.sigma_s, 2);
    by_chance += repeatability(steady)[0].trends.at(0).significant();
    steady.resize(4);
    of_four_by_chance += repeatability(steady)[0].trends.at(0).significant();
  }
  EXPECT_EQ(found, runs);
  // Student's t with 10 degrees of freedom has variance 10/8; 0.27 % of 400 is 1.1. Bounds at 5 sigma of the counts.
  EXPECT_NEAR(squares / runs, 1.25, 0.65);
  EXPECT_LT(by_chance, 7);
  EXPECT_LT(of_four_by_chance, 7);
}

TEST(Repeatability, TemperaturesAreBinnedAsThePaperDoes) {
  std::vector<Estimate> results;
  for (const double t : {24.2, 24.8, 24.5}) results.push_back(answer(3.033e-3 + 1e-6 * t, 1e-5, 0, t));
  for (const double t : {37.1, 36.9}) results.push_back(answer(3.157e-3, 1e-5, 0, t));
  const auto r = repeatability(results);
  ASSERT_EQ(r[0].bins.size(), 2u);
  EXPECT_NEAR(r[0].bins[0].mean_c, 24.5, 1e-9);
  EXPECT_NEAR(r[0].bins[0].half_width_c, 0.3, 1e-9);
  EXPECT_EQ(r[0].bins[0].answers, 3u);
  EXPECT_EQ(r[0].bins[1].answers, 2u);
  EXPECT_NEAR(to_seconds(r[0].bins[1].mean), 3.157e-3, 1e-9);
  EXPECT_NE(in_words(r[0]).find("at 37.0 ± 0.1 °C"), std::string::npos);
}

TEST(Repeatability, FewAnswersSayNothingOfOutliersOrTrends) {
  const auto r = repeatability({answer(1, 1e-3), answer(2, 1e-3), answer(3, 1e-3)});
  EXPECT_TRUE(r[0].outliers.empty());
  EXPECT_TRUE(r[0].trends.empty());
  EXPECT_TRUE(r[0].bins.empty());
}

}  // namespace
}  // namespace takt
