// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace takt {
namespace {

/// A smooth scene as a function of place, sampled where a warp puts each pixel.
struct Scene {
  static double grey(const Vec2& p) {
    return 120 + 40 * std::sin(0.5 * p.x() + 0.2 * p.y()) + 30 * std::cos(0.35 * p.y() - 0.3 * p.x()) +
           20 * std::sin(0.11 * p.x() * p.y() / 10);
  }
  std::vector<std::uint8_t> pixels;
  GrayImage image;

  Scene(const PatchPlace& place, double gain, double offset) {
    constexpr int side = 80;
    const Eigen::Matrix2d back = place.shape.inverse();
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x)
        pixels.push_back(static_cast<std::uint8_t>(
            std::lround(gain * grey(Vec2(40, 40) + back * (Vec2(x, y) - place.at)) + offset)));
    image = {side, side, side, pixels.data(), nullptr};
  }
};

const PatchPlace where_it_was{{40, 40}, Eigen::Matrix2d::Identity()};

TEST(Patch, IsFoundUnderAnAffineWarpInOtherLight) {
  const Scene before(where_it_was, 1, 0);
  const auto patch = Patch::cut(before.image, {40, 40}, 15);
  ASSERT_TRUE(patch);
  PatchPlace truth{{42.37, 38.81}, Eigen::Matrix2d::Identity()};
  truth.shape << 1.05, -0.12, 0.15, 0.93;
  const Scene after(truth, 0.7, 25);
  const auto found = patch->find(after.image, {{41.5, 39.5}, Eigen::Matrix2d::Identity()});
  ASSERT_TRUE(found);
  EXPECT_LT((found->place.at - truth.at).norm(), 0.02);
  EXPECT_LT((found->place.shape - truth.shape).norm(), 0.03);
  EXPECT_GT(found->correlation, 0.99);
}

TEST(Patch, AFlatOrCutOffPlaceIsNoPatch) {
  const std::vector<std::uint8_t> flat(40 * 40, 90);
  const GrayImage image{40, 40, 40, flat.data(), nullptr};
  EXPECT_FALSE(Patch::cut(image, {20, 20}, 15));
  const Scene scene(where_it_was, 1, 0);
  EXPECT_FALSE(Patch::cut(scene.image, {4, 40}, 15));
  const auto patch = Patch::cut(scene.image, {40, 40}, 15);
  ASSERT_TRUE(patch);
  EXPECT_FALSE(patch->find(scene.image, {{3, 40}, Eigen::Matrix2d::Identity()}));
  EXPECT_FALSE(patch->find(image, {{20, 20}, Eigen::Matrix2d::Identity()}));
}

}  // namespace
}  // namespace takt
