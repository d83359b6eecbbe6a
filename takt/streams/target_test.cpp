// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/target.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "takt/streams/markers.h"

namespace takt {
namespace {

/// Whether the print is black at a place of the board.
bool black_at(const std::vector<InkShape>& ink, const Vec2& p) {
  bool black = false;
  for (const InkShape& s : ink) {
    if ((p.array() < s.low.array()).any() || (p.array() > s.high.array()).any()) continue;
    if (s.kind == InkShape::Kind::disc && (p - 0.5 * (s.low + s.high)).norm() > 0.5 * (s.high.x() - s.low.x()))
      continue;
    black = s.black;
  }
  return black;
}

TEST(Target, AprilGridPointsAreKalibrs) {
  const AprilGrid g{.columns = 6, .rows = 4};
  const auto points = board_points(g);
  ASSERT_EQ(points.size(), 96u);
  EXPECT_EQ(points[0], Vec3::Zero());
  EXPECT_EQ(points[1], Vec3(0.088, 0, 0));
  EXPECT_NEAR(points[2].x(), 1.3 * 0.088, 1e-15);
  EXPECT_EQ(points[12], Vec3(0, 0.088, 0));
  EXPECT_NEAR(points[24].y(), 1.3 * 0.088, 1e-15);
}

TEST(Target, CheckerboardAndCirclesAsKalibrCountsThem) {
  EXPECT_EQ(board_points(Checkerboard{4, 3, 0.06, 0.05})[5], Vec3(0.06, 0.05, 0));
  EXPECT_EQ(board_points(CircleGrid{4, 11, 0.02, true})[5], Vec3(0.06, 0.02, 0));
  EXPECT_EQ(board_points(CircleGrid{4, 11, 0.02, false})[5], Vec3(0.02, 0.02, 0));
  EXPECT_EQ(board_points(Charuco{})[8], Vec3(2 * 0.03, 2 * 0.03, 0));  // 7 corners in a row
}

TEST(Target, EveryCornerIsASaddleOfTheInk) {
  const double h = 0.002;
  for (const Target& t : {Target(AprilGrid{}), Target(AprilGrid{3, 2, 0.05, 0.25, 7, 1}), Target(Checkerboard{}),
                          Target(Charuco{}), Target(Charuco{5, 4, 0.04, 0.03, "DICT_4X4_50", true})}) {
    const auto ink = board_ink(t);
    for (const Vec3& p : board_points(t)) {
      const auto at = [&](double x, double y) { return black_at(ink, p.head<2>() + Vec2(x, y)); };
      EXPECT_EQ(at(h, h), at(-h, -h)) << target_type(t) << " " << p.transpose();
      EXPECT_EQ(at(-h, h), at(h, -h)) << target_type(t) << " " << p.transpose();
      EXPECT_NE(at(h, h), at(h, -h)) << target_type(t) << " " << p.transpose();
    }
  }
}

TEST(Target, TheCornersOfTheInkAreWhatTheTextSays) {
  const auto checkerboard = board_ink(Checkerboard{9, 6, 0.03, 0.03});
  EXPECT_TRUE(black_at(checkerboard, {-0.01, -0.01}));  // the square before the origin
  EXPECT_FALSE(black_at(checkerboard, {-0.01, 0.01}));
  EXPECT_TRUE(black_at(board_ink(Charuco{5, 6}), {0.01, 0.175}));  // upper left
  EXPECT_FALSE(black_at(board_ink(Charuco{5, 6, 0.03, 0.02, "DICT_4X4_50", true}), {0.001, 0.179}));
  EXPECT_TRUE(black_at(board_ink(CircleGrid{4, 11, 0.02, true}), {0.02, 0.02}));
  EXPECT_FALSE(black_at(board_ink(CircleGrid{4, 11, 0.02, true}), {0.02, 0.0}));
}

TEST(Target, MarkersHaveTheirBordersAndTagsAreTurned) {
  const auto tags = board_markers(AprilGrid{});
  ASSERT_EQ(tags.size(), 36u);
  EXPECT_EQ(tags[7].id, 7);
  EXPECT_EQ(tags[0].cells, 10);
  const MarkerDictionary& family = marker_dictionary("DICT_APRILTAG_36h11");
  EXPECT_EQ(family.bits, 6);
  EXPECT_EQ(family.count, 587);
  // Half a turn: the first bit of OpenCV's marker is the last of the board's.
  EXPECT_EQ(tags[0].black[static_cast<std::size_t>(7 * 10 + 7)], !family.white[0][0]);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(tags[3].black[static_cast<std::size_t>(10 + i)]);
  EXPECT_EQ(board_markers(Charuco{8, 6}).size(), 24u);
  EXPECT_TRUE(board_markers(Checkerboard{}).empty());
}

TEST(Target, WhatCannotBeIsRefused) {
  for (const Target& t :
       {Target(AprilGrid{0, 6}), Target(AprilGrid{30, 30}), Target(AprilGrid{6, 6, 88.0 * 10, 0.3}),
        Target(AprilGrid{6, 6, 0.088, 0}), Target(Checkerboard{1, 6}), Target(CircleGrid{4, 11, 0.02, false, 0.03}),
        Target(Charuco{8, 6, 0.03, 0.04}), Target(Charuco{8, 6, 0.03, 0.02, "DICT_9X9"})})
    EXPECT_THROW(check(t), std::invalid_argument) << target_type(t);
  EXPECT_NO_THROW(check(AprilGrid{}));
}

TEST(Target, SeenFromTheFrontTheBoardsAreNotMirrored) {
  EXPECT_NEAR(seen_from_front(AprilGrid{}).determinant(), 1, 0);
  EXPECT_NEAR(seen_from_front(Checkerboard{}).determinant(), 1, 0);
  EXPECT_NEAR(seen_from_front(CircleGrid{}).determinant(), -1, 0);
}

}  // namespace
}  // namespace takt
