// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/two_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <stdexcept>
#include <vector>

namespace takt {
namespace {

struct Scene {
  BearingPairs pairs;
  Quat rotation;
};

/// `n` points 2–8 m ahead in a field of view of about 80°, seen before and after a motion, bearings with noise.
Scene make_scene(std::mt19937_64& random, int n, const Vec3& rotation, const Vec3& translation_m, double sigma_rad,
                 double outliers = 0) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> gauss;
  Scene s;
  s.rotation = exp_so3(rotation);
  s.pairs.from.resize(3, n);
  s.pairs.to.resize(3, n);
  const auto noisy = [&](const Vec3& p) {
    return (p.normalized() + sigma_rad * Vec3(gauss(random), gauss(random), gauss(random))).normalized().eval();
  };
  for (int i = 0; i < n; ++i) {
    const double depth = 5 + 3 * uniform(random);
    const Vec3 p_from(0.84 * depth * uniform(random), 0.6 * depth * uniform(random), depth);
    const Vec3 p_to = s.rotation.conjugate() * (p_from - translation_m);
    s.pairs.from.col(i) = noisy(p_from);
    s.pairs.to.col(i) = noisy(p_to);
    if (i < outliers * n) s.pairs.to.col(i) = noisy(p_to + Vec3(uniform(random), uniform(random), 0));
  }
  return s;
}

struct Statistics {
  double nees;       ///< median of δᵀ·information·δ; 2.37 for the three degrees of freedom of an honest answer
  double error_rad;  ///< median
};

Statistics run(double step_m, double outliers) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> gauss;
  std::vector<double> nees, errors;
  for (int k = 0; k < 201; ++k) {
    const Vec3 rotation = 0.03 * Vec3(gauss(random), gauss(random), gauss(random));
    const Vec3 translation = step_m * Vec3(gauss(random), gauss(random), gauss(random));
    const Scene s = make_scene(random, 120, rotation, translation, 5e-4, outliers);
    const auto fit = fit_two_view(s.pairs);
    if (!fit) throw std::runtime_error("no fit");
    const Vec3 error = log_so3(fit->rotation.conjugate() * s.rotation);
    nees.push_back(error.dot(fit->information * error));
    errors.push_back(error.norm());
  }
  const auto median = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + 100, v.end());
    return v[100];
  };
  return {median(nees), median(errors)};
}

TEST(TwoView, PureRotationIsFoundWithHonestInformation) {
  const Statistics s = run(0, 0);
  // The median of 201 draws of χ²(3) has a standard deviation of 0.19.
  EXPECT_NEAR(s.nees, 2.37, 4 * 0.19);
}

TEST(TwoView, TranslationDoesNotLeakIntoRotation) {
  const double still = run(0, 0).error_rad;
  for (const double step_m : {0.005, 0.02, 0.1}) {
    const Statistics s = run(step_m, 0);
    EXPECT_LT(s.nees, 2.37 + 4 * 0.19) << step_m << " m";
    EXPECT_LT(s.error_rad, 1.5 * still) << step_m << " m";
  }
}

TEST(TwoView, AQuarterOfOutliersIsSurvived) {
  const Statistics s = run(0.02, 0.25);
  EXPECT_LT(s.nees, 2.37 + 4 * 0.19);
  EXPECT_LT(s.error_rad, 1.5 * run(0.02, 0).error_rad);
}

TEST(TwoView, AtTheTruthTheNormalsAskForNoStepBeyondTheirSigma) {
  std::mt19937_64 random(3);
  const int trials = 200;
  double nees = 0, sigma = 0;
  for (int k = 0; k < trials; ++k) {
    const Scene s = make_scene(random, 120, Vec3(0.02, -0.03, 0.01), Vec3(0.03, 0.01, 0.02), 5e-4);
    const auto n = two_view_normals(s.pairs, s.rotation);
    ASSERT_TRUE(n);
    nees += n->gradient.dot(n->information.ldlt().solve(n->gradient)) / trials;
    sigma += n->sigma_rad / trials;
  }
  // The depth scatter is allowed for, not known, so the answer may be better than it says, never worse.
  EXPECT_LT(nees, 3 + 4 * std::sqrt(6.0 / trials));
  EXPECT_GT(nees, 1);
  EXPECT_NEAR(sigma, 5e-4, 0.5e-4);
}

TEST(TwoView, TooFewMatchesAreNoAnswer) {
  std::mt19937_64 random(5);
  const Scene s = make_scene(random, 5, Vec3::Zero(), Vec3::Zero(), 1e-4);
  EXPECT_FALSE(fit_two_view(s.pairs));
  EXPECT_FALSE(two_view_normals(s.pairs, s.rotation));
}

}  // namespace
}  // namespace takt
