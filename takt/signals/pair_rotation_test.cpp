// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/pair_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

namespace takt {
namespace {

constexpr double sigma_rad = 3e-4;

struct Pair {
  std::vector<BearingMatch> matches;
  Vec3 rotation;
};

/// A scene 2–8 m ahead over a view of about 80°×60°.
Pair make_pair_of_views(std::mt19937_64& random, int n, const Vec3& rotation, const Vec3& translation_m,
                        double share_of_outliers) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> gauss;
  const auto seen = [&](const Vec3& p) {
    Vec3 b = p.normalized();
    b += sigma_rad * Vec3(gauss(random), gauss(random), gauss(random));
    return b.normalized().cast<float>().eval();
  };
  Pair out;
  out.rotation = rotation;
  const Mat3 R = exp_so3(rotation).toRotationMatrix();
  for (int i = 0; i < n; ++i) {
    const double depth = 5 + 3 * uniform(random);
    const Vec3 from(0.84 * depth * uniform(random), 0.6 * depth * uniform(random), depth);
    Vec3 to = R.transpose() * (from - translation_m);
    if (i < share_of_outliers * n) to += 0.1 * depth * Vec3(uniform(random), uniform(random), 0);
    BearingMatch m;
    m.from = seen(from);
    m.to = seen(to);
    m.sigma_rad = static_cast<float>(sigma_rad);
    out.matches.push_back(m);
  }
  return out;
}

/// Mean of (error/σ)² per degree of freedom over seeded pairs.
double normalised_error(const Vec3& translation_m, double outliers, bool sigma_is_known, int runs) {
  std::mt19937_64 random(20);
  std::normal_distribution<double> gauss;
  PairRotationOptions options;
  options.sigma_is_known = sigma_is_known;
  double sum = 0;
  for (int k = 0; k < runs; ++k) {
    const Vec3 rotation = 0.02 * Vec3(gauss(random), gauss(random), gauss(random));
    const Pair pair = make_pair_of_views(random, 150, rotation, translation_m, outliers);
    const PairRotation found = rotation_of_pair(pair.matches, options);
    EXPECT_EQ(found.outcome, PairOutcome::measured);
    const Vec3 error = log_so3(exp_so3(found.rotation).conjugate() * exp_so3(rotation));
    sum += error.dot(found.information * error) / 3;
  }
  return sum / runs;
}

// The mean of χ²(3)/3 over 300 runs scatters by √(2/3/300) = 0.047; the measured noise level adds its own ±8 % a run,
// which raises the mean by about 3·0.08² = 2 %. The bounds are four deviations: a false alarm in 16 000.
TEST(PairRotation, ErrorOverSigmaOfAPureRotationIsOne) {
  EXPECT_NEAR(normalised_error(Vec3::Zero(), 0, true, 300), 1, 4 * 0.05 + 0.02);
  EXPECT_NEAR(normalised_error(Vec3::Zero(), 0, false, 300), 1, 4 * 0.05 + 0.04);
}

// With translation the depths' scatter is allowed for, not known: the error may be smaller than said, never larger.
TEST(PairRotation, ErrorOverSigmaUnderTranslationAndOutliersIsAtMostOne) {
  const double found = normalised_error(Vec3(0.02, 0.01, 0.01), 0.2, false, 300);
  EXPECT_LT(found, 1.25);
  EXPECT_GT(found, 0.3);
}

TEST(PairRotation, OutliersAreNotHandedOn) {
  std::mt19937_64 random(4);
  const Pair pair = make_pair_of_views(random, 200, Vec3(0.01, -0.03, 0.02), Vec3(0.02, 0, 0), 0.25);
  const PairRotation found = rotation_of_pair(pair.matches);
  ASSERT_EQ(found.outcome, PairOutcome::measured);
  // An outlier may land close to its true place by chance, or be spoilt along the parallax only.
  EXPECT_LT(found.matches.size(), 165u);
  EXPECT_GT(found.matches.size(), 140u);
  EXPECT_NEAR(found.sigma_ratio, 1, 0.3);
}

TEST(PairRotation, FewMatchesAndNonsenseAreTold) {
  std::mt19937_64 random(5);
  Pair pair = make_pair_of_views(random, 11, Vec3::Zero(), Vec3::Zero(), 0);
  EXPECT_EQ(rotation_of_pair(pair.matches).outcome, PairOutcome::too_few_matches);
  EXPECT_EQ(rotation_of_pair({}).outcome, PairOutcome::too_few_matches);
  pair = make_pair_of_views(random, 150, Vec3::Zero(), Vec3::Zero(), 1);
  EXPECT_EQ(rotation_of_pair(pair.matches).outcome, PairOutcome::unexplained);
}

TEST(SpreadOverView, TakesFromEveryPartOfTheView) {
  std::mt19937_64 random(6);
  auto matches = make_pair_of_views(random, 300, Vec3::Zero(), Vec3::Zero(), 0).matches;
  BearingMatch lonely;
  lonely.from = lonely.to = Vec3(-1, -1, 0.3).normalized().cast<float>();
  matches.push_back(lonely);
  const auto chosen = spread_over_view(matches, 100);
  ASSERT_EQ(chosen.size(), 100u);
  EXPECT_TRUE(std::any_of(chosen.begin(), chosen.end(), [&](const auto& m) { return m.from == lonely.from; }));
  EXPECT_EQ(spread_over_view(matches, 1000).size(), matches.size());
}

}  // namespace
}  // namespace takt
