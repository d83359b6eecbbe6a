// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/simulated_corners.h"

#include <gtest/gtest.h>

#include <cmath>

namespace takt {
namespace {

TEST(SimulatedCorners, TheBoardIsInViewAndTheImuIsExcited) {
  TargetFilmOptions o;
  o.duration_s = 20;
  const SimulatedBoard run = simulate_board(o);
  const CornerStream& camera = run.cameras[0];
  double seen = 0, squares = 0;
  for (const auto& corners : camera.corners) seen += static_cast<double>(corners.size());
  for (const Vec3& w : run.imus[0].gyro_rad_s) squares += w.squaredNorm();
  EXPECT_GT(seen / static_cast<double>(camera.size()), 90);
  EXPECT_LT(seen / static_cast<double>(camera.size()), 143);  // partial views too
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(run.imus[0].size())), 1.6, 0.3);
}

TEST(SimulatedCorners, ACornerIsWhereTheModelPutsIt) {
  TargetFilmOptions o;
  o.duration_s = 3;
  o.cameras = 2;
  const SimulatedBoard run = simulate_board(o, {.noise_px = 0});
  for (std::size_t c = 0; c < 2; ++c)
    for (std::size_t k = 0; k < run.cameras[c].size(); k += 7) {
      const auto camera_from_world =
          cam_from_world(*run.film.trajectory, *run.cameras[c].T_body_cam, run.film.exposures[c][k].middle_s);
      for (const CornerObservation& corner : run.cameras[c].corners[k]) {
        const Vec3 point = camera_from_world *
                           (run.film.world_from_board * run.cameras[c].board[static_cast<std::size_t>(corner.corner)]);
        EXPECT_LT((*run.cameras[c].model->project(point) - corner.pixel).norm(), 1e-9);
      }
    }
}

TEST(SimulatedCorners, NothingIsSeenBeforeTheBoardComes) {
  TargetFilmOptions o;
  o.duration_s = 4;
  const SimulatedBoard run = simulate_board(o, {.absent_until_s = 2});
  for (std::size_t k = 0; k < run.cameras[0].size(); ++k)
    EXPECT_EQ(run.cameras[0].corners[k].empty(), run.film.exposures[0][k].middle_s < 2);
}

/// Two IMUs on a rigid body: the second feels the first's motion turned, plus what the lever adds, at its own clock.
TEST(SimulatedCorners, ASecondImuFeelsTheSameBody) {
  TargetFilmOptions o;
  o.duration_s = 3;
  o.imus = 2;
  o.imu_offset_step_s = 0.0034;
  o.imu.noise = {};
  o.imu.gyro_bias_rad_s = o.imu.accel_bias_m_s2 = 0;
  const SimulatedBoard run = simulate_board(o);
  ASSERT_EQ(run.imus.size(), 2u);
  ASSERT_EQ(run.truth.estimates.size(), 1u);
  const Mat4 T = *run.truth.estimates[0].T_reference_sensor;
  const Mat3 R = T.topLeftCorner<3, 3>();
  const Vec3 lever = T.topRightCorner<3, 1>();
  constexpr double h = 1.0 / 200;
  const ImuStream &a = run.imus[0], &b = run.imus[1];
  for (std::size_t i = 10; i + 10 < a.size(); i += 17) {
    EXPECT_EQ((a.stamps[i] - b.stamps[i]).count(), 3'400'000);
    EXPECT_LT((R * b.gyro_rad_s[i] - a.gyro_rad_s[i]).norm(), 1e-9);
    const Vec3 w = a.gyro_rad_s[i], turning = (a.gyro_rad_s[i + 1] - a.gyro_rad_s[i - 1]) / (2 * h);
    const Vec3 there = a.accel_m_s2[i] + turning.cross(lever) + w.cross(w.cross(lever));
    EXPECT_LT((R * b.accel_m_s2[i] - there).norm(), 0.02);  // the difference quotient is not exact
  }
}

}  // namespace
}  // namespace takt
