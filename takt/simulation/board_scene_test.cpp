// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/board_scene.h"

#include <gtest/gtest.h>

#include <cmath>

namespace takt {
namespace {

std::vector<Vec3> grid() {
  std::vector<Vec3> points;
  for (int row = 0; row < 12; ++row)
    for (int column = 0; column < 12; ++column) points.emplace_back(0.058 * column, 0.058 * row, 0);
  return points;
}

TEST(BoardScene, TheBoardIsInViewAndTheImuIsExcited) {
  BoardOptions o;
  o.duration_s = 20;
  const SimulatedBoard run = simulate_board(o, {}, grid());
  double seen = 0, squares = 0;
  for (const auto& corners : run.corners.corners) seen += static_cast<double>(corners.size());
  for (const Vec3& w : run.imu.gyro_rad_s) squares += w.squaredNorm();
  EXPECT_GT(seen / static_cast<double>(run.corners.size()), 90);
  EXPECT_LT(seen / static_cast<double>(run.corners.size()), 143);  // partial views too
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(run.imu.size())), 1.6, 0.3);
}

TEST(BoardScene, ACornerIsWhereTheModelPutsIt) {
  BoardOptions o;
  o.duration_s = 3;
  const SimulatedBoard run = simulate_board(o, {.noise_px = 0}, grid());
  const CameraModel model = o.camera.model();
  for (std::size_t k = 0; k < run.corners.size(); k += 7) {
    const auto camera_from_world =
        cam_from_world(*run.scene.trajectory, o.camera.T_body_cam, run.exposures[k].middle_s);
    for (const CornerObservation& c : run.corners.corners[k]) {
      const Vec3 point = camera_from_world * (run.scene.world_from_board * run.corners.board[c.corner]);
      EXPECT_LT((*model.project(point) - c.pixel).norm(), 1e-9);
    }
  }
}

TEST(BoardScene, NothingIsSeenBeforeTheBoardComes) {
  BoardOptions o;
  o.duration_s = 4;
  const SimulatedBoard run = simulate_board(o, {.absent_until_s = 2}, grid());
  for (std::size_t k = 0; k < run.corners.size(); ++k)
    EXPECT_EQ(run.corners.corners[k].empty(), run.exposures[k].middle_s < 2);
}

}  // namespace
}  // namespace takt
