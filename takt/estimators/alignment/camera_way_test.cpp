// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/camera_way.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/simulation/random.h"

namespace takt::alignment {
namespace {

constexpr double length_s = 0.4, step_s = 0.05, duration_s = 30;

/// A hand's way: up to 1.5 Hz, and a steady part.
Vec3 position(double t) {
  return {0.05 * t + 0.02 * std::sin(9.0 * t), 0.03 * std::sin(4.0 * t + 1), 0.04 * std::cos(2.2 * t)};
}

std::vector<WayPiece> pieces_of(double noise, bool wild) {
  Random random(7, "way");
  std::vector<WayPiece> pieces;
  for (double t = 0; t + length_s < duration_s; t += step_s) {
    WayPiece p{t, t + length_s, position(t + length_s) - position(t)};
    p.moved += noise * Vec3(random.normal(), random.normal(), random.normal());
    if (wild && random.uniform(0, 1) < 0.05) p.moved += Vec3(1, -1, 1);
    pieces.push_back(p);
  }
  return pieces;
}

/// Of the way within 10 ms, against the way itself.
double relative_error(const CameraWay& way) {
  double errors = 0, moved = 0;
  for (double t = 1; t < duration_s - 1; t += 0.037) {
    const Vec3 truth = position(t + 0.01) - position(t);
    errors += (way.between(t, t + 0.01) - truth).squaredNorm(), moved += truth.squaredNorm();
  }
  return std::sqrt(errors / moved);
}

TEST(CameraWay, SaysHowTheCameraMovesWithinAFrameFromPiecesFortyTimesAsLong) {
  EXPECT_LT(relative_error(CameraWay(pieces_of(0, false), length_s)), 0.03);
  EXPECT_LT(relative_error(CameraWay(pieces_of(5e-4, false), length_s)), 0.05);
}

TEST(CameraWay, IsNotMovedByWildPieces) {
  EXPECT_LT(relative_error(CameraWay(pieces_of(5e-4, true), length_s)), 0.06);
}

TEST(CameraWay, KnowsNoMotionWithoutPiecesAndIsStillOutsideThem) {
  EXPECT_EQ(CameraWay().between(0, 1), Vec3(Vec3::Zero()));
  EXPECT_EQ(CameraWay({}, length_s).between(0, 1), Vec3(Vec3::Zero()));
  const CameraWay way(pieces_of(0, false), length_s);
  EXPECT_EQ(way.between(-2, -1), Vec3(Vec3::Zero()));
  EXPECT_EQ(way.between(duration_s + 1, duration_s + 2), Vec3(Vec3::Zero()));
}

}  // namespace
}  // namespace takt::alignment
