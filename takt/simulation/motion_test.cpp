// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/motion.h"

#include <gtest/gtest.h>

#include <cmath>

namespace takt {
namespace {

class Motions : public testing::TestWithParam<Motion> {};
INSTANTIATE_TEST_SUITE_P(All, Motions, testing::ValuesIn(motions().begin(), motions().end()),
                         [](const auto& row) { return row.param.name; });

TEST_P(Motions, DerivativesMatchNumericDifferences) {
  const double h = 1e-5;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const auto truth = make_trajectory(GetParam(), seed);
    for (double t = 0.2; t < 30; t += 1.37) {
      const auto before = truth->world_from_body(t - h), after = truth->world_from_body(t + h);
      const Vec3 omega = log_so3(Quat(before.linear().transpose() * after.linear())) / (2 * h);
      const Vec3 velocity = (after.translation() - before.translation()) / (2 * h);
      const Vec3 acceleration = (truth->velocity_world(t + h) - truth->velocity_world(t - h)) / (2 * h);
      // The difference over ±h turns about the mean axis; its error is of order h²·|ω|³ ≈ 1e-8.
      EXPECT_LT((truth->omega_body(t) - omega).norm(), 1e-6) << "t = " << t;
      EXPECT_LT((truth->velocity_world(t) - velocity).norm(), 1e-6) << "t = " << t;
      EXPECT_LT((truth->acceleration_world(t) - acceleration).norm(), 1e-6) << "t = " << t;
    }
  }
}

TEST_P(Motions, StayInTheRoom) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const auto truth = make_trajectory(GetParam(), seed);
    for (double t = 0; t < 60; t += 0.5) {
      const Vec3 p = truth->world_from_body(t).translation();
      ASSERT_TRUE((p.array().abs() < GetParam().room_half_extent_m.array()).all()) << "seed " << seed;
    }
  }
}

TEST_P(Motions, TurnAndMoveAsMuchAsTheirRowSays) {
  // Over 200 s and 20 seeds the mean square of the whole ensemble lies within the row's limits, give or take 10 %.
  const Motion& m = GetParam();
  double turn = 0, speed = 0;
  int n = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto truth = make_trajectory(m, seed);
    for (double t = 0; t < 200; t += 0.331, ++n) {
      turn += truth->omega_body(t).squaredNorm();
      speed += truth->velocity_world(t).squaredNorm();
    }
  }
  turn = std::sqrt(turn / n);
  speed = std::sqrt(speed / n);
  const double calm = std::hypot(m.turn_calm_rad_s, m.constant_rate_rad_s);
  const double lively = std::hypot(m.turn_lively_rad_s, m.constant_rate_rad_s);
  EXPECT_GE(turn, 0.9 * calm);
  EXPECT_LE(turn, 1.1 * lively);
  EXPECT_GE(speed, 0.9 * std::hypot(m.speed_calm_m_s, m.constant_speed_m_s));
  EXPECT_LE(speed, 1.1 * std::hypot(m.speed_lively_m_s, m.constant_speed_m_s));
}

TEST(Motion, ASingleAxisStaysOne) {
  for (const char* name : {"single_axis", "single_tone", "constant_rate"}) {
    const auto truth = make_trajectory(find_motion(name), 4);
    const Vec3 axis = truth->omega_body(0.1).normalized();
    for (double t = 0; t < 20; t += 0.7) EXPECT_LT(truth->omega_body(t).cross(axis).norm(), 1e-9) << name;
  }
}

TEST(Motion, StillnessIsExact) {
  const auto truth = make_trajectory(find_motion("still"), 1);
  EXPECT_EQ(truth->omega_body(3), Vec3::Zero());
  EXPECT_TRUE(truth->specific_force_body(3).isApprox(Vec3(0, 0, 9.81), 1e-12));
}

TEST(Motion, SeedsDiffer) {
  const auto a = make_trajectory(find_motion("handheld"), 1), b = make_trajectory(find_motion("handheld"), 2);
  EXPECT_GT((a->omega_body(1) - b->omega_body(1)).norm(), 1e-2);
}

TEST(Motion, RefusesUnknownNamesAndEscapes) {
  EXPECT_THROW(static_cast<void>(find_motion("dance")), std::invalid_argument);
  Motion rocket = find_motion("handheld");
  rocket.speed_calm_m_s = rocket.speed_lively_m_s = 50;
  EXPECT_THROW(static_cast<void>(make_trajectory(rocket, 1)), std::invalid_argument);
}

}  // namespace
}  // namespace takt
