// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/feature_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <set>
#include <stdexcept>

namespace takt {
namespace {

/// Structure of all sizes from 4 px up, so that halving the image leaves something to see.
cv::Mat texture(int width, int height) {
  cv::RNG random(5);
  cv::Mat sum(height, width, CV_32F, cv::Scalar(128)), out;
  for (int cell = 4; cell <= 64; cell *= 2) {
    cv::Mat coarse(height / cell, width / cell, CV_32F), fine;
    random.fill(coarse, cv::RNG::NORMAL, 0, 20);
    cv::resize(coarse, fine, sum.size(), 0, 0, cv::INTER_CUBIC);
    sum += fine;
  }
  sum.convertTo(out, CV_8U);
  return out;
}

/// A part of a larger picture, without a copy: rows are further apart than they are long.
GrayImage window(const cv::Mat& picture, int x, int y, int width, int height) {
  return {width, height, static_cast<std::ptrdiff_t>(picture.step), picture.ptr(y, x), nullptr};
}

void expect_shift(int width, int height, int reduction) {
  const cv::Mat picture = texture(width + 64, height + 64);
  FeatureTracker tracker;
  EXPECT_TRUE(tracker.observe(window(picture, 20, 20, width, height)).empty());
  EXPECT_EQ(tracker.reduction(), reduction);
  EXPECT_GT(tracker.alive(), 150u);
  const auto matches = tracker.observe(window(picture, 27, 16, width, height));  // things move by (−7, +4)
  ASSERT_GT(matches.size(), 140u);
  double sum_x = 0, sum_y = 0;
  for (const FeatureMatch& m : matches) {
    EXPECT_NEAR(m.to.x() - m.from.x(), -7, 0.3 * reduction);
    EXPECT_NEAR(m.to.y() - m.from.y(), 4, 0.3 * reduction);
    sum_x += m.to.x() - m.from.x(), sum_y += m.to.y() - m.from.y();
  }
  EXPECT_NEAR(sum_x / static_cast<double>(matches.size()), -7, 0.05);
  EXPECT_NEAR(sum_y / static_cast<double>(matches.size()), 4, 0.05);
}

TEST(FeatureTracker, FindsAShiftAtFullSize) {
  expect_shift(640, 400, 1);
}
TEST(FeatureTracker, FindsAShiftAtHalfSize) {
  expect_shift(1280, 720, 2);
}
TEST(FeatureTracker, OddSizesAreHalvedToo) {
  expect_shift(1281, 721, 2);
}

TEST(FeatureTracker, FollowsTheCornerAndNotTheWindowWhereThePictureTurnsAndGrows) {
  const cv::Mat picture = texture(640, 480);
  const Vec2 centre(320, 240);
  FeatureTracker tracker;
  std::map<std::int64_t, Vec2> born;
  double squares = 0, count = 0;
  for (int frame = 0; frame < 25; ++frame) {
    const double angle = 0.03 * frame, scale = 1 + 0.008 * frame;
    cv::Mat turned;
    cv::warpAffine(picture, turned, cv::getRotationMatrix2D({320, 240}, angle * 180 / std::numbers::pi, scale),
                   picture.size(), cv::INTER_CUBIC);
    // OpenCV turns counterclockwise with y pointing down.
    const Eigen::Matrix2d warp = scale * Eigen::Rotation2Dd(-angle).toRotationMatrix();
    for (const FeatureMatch& m : tracker.observe(window(turned, 0, 0, 640, 480))) {
      const Vec2 now = warp.inverse() * (m.to - centre);
      const auto first = born.try_emplace(m.id, now).first->second;
      if (now.cwiseAbs().maxCoeff() > 150) continue;  // the turned picture ends somewhere
      squares += (now - first).squaredNorm() / 2, count += 1;
    }
  }
  ASSERT_GT(count, 1000);
  // A window that is only shifted, from frame to frame, goes astray by more than half a pixel here.
  EXPECT_LT(std::sqrt(squares / count), 0.1);
}

TEST(FeatureTracker, PositionsBelongToThePixelsWhereverTheWorkIsDone) {
  // One bright disc on a flat ground: whatever is tracked on its rim stays on its rim, in full-size pixels.
  cv::Mat picture(900, 1400, CV_8U, cv::Scalar(60));
  cv::circle(picture, {700, 450}, 8, 200, -1, cv::LINE_AA);
  FeatureTracker tracker;
  tracker.observe(window(picture, 0, 0, 1280, 720));
  const auto matches = tracker.observe(window(picture, 6, 2, 1280, 720));
  ASSERT_FALSE(matches.empty());
  for (const FeatureMatch& m : matches) {
    EXPECT_LT((m.from - Vec2(700, 450)).norm(), 20);
    EXPECT_LT((m.to - m.from - Vec2(-6, -2)).norm(), 0.3);
  }
}

TEST(FeatureTracker, FeaturesKeepTheirIdAndLostOnesAreReplaced) {
  const cv::Mat picture = texture(640 + 400, 400);
  FeatureTracker tracker;
  tracker.observe(window(picture, 0, 0, 640, 400));
  std::set<std::int64_t> first, last;
  for (int step = 1; step <= 30; ++step) {
    const auto matches = tracker.observe(window(picture, 10 * step, 0, 640, 400));
    EXPECT_GT(tracker.alive(), 150u);
    last.clear();
    for (const FeatureMatch& m : matches) EXPECT_TRUE(last.insert(m.id).second) << "twice: " << m.id;
    if (step == 1) first = last;
  }
  const auto lived = std::count_if(first.begin(), first.end(), [&](std::int64_t id) { return last.contains(id); });
  // 300 of 640 px have left the view; of what stayed most is still the same.
  EXPECT_GT(lived, static_cast<std::ptrdiff_t>(0.4 * static_cast<double>(first.size())));
  EXPECT_LT(lived, static_cast<std::ptrdiff_t>(0.6 * static_cast<double>(first.size())));
}

TEST(FeatureTracker, AFlatPictureHasNoFeatures) {
  const cv::Mat grey(400, 640, CV_8U, cv::Scalar(90));
  FeatureTracker tracker;
  tracker.observe(window(grey, 0, 0, 640, 400));
  EXPECT_EQ(tracker.alive(), 0u);
  EXPECT_TRUE(tracker.observe(window(grey, 0, 0, 640, 400)).empty());
}

TEST(FeatureTracker, AChangeOfSizeStartsAnew) {
  const cv::Mat picture = texture(800, 600);
  FeatureTracker tracker;
  tracker.observe(window(picture, 0, 0, 640, 400));
  EXPECT_TRUE(tracker.observe(window(picture, 0, 0, 600, 400)).empty());
  EXPECT_FALSE(tracker.observe(window(picture, 1, 0, 600, 400)).empty());
}

TEST(FeatureTracker, TinyAndEmptyImages) {
  const cv::Mat picture = texture(64, 64);
  FeatureTracker tracker;
  EXPECT_THROW(tracker.observe(GrayImage{}), std::invalid_argument);
  for (const int size : {1, 2, 7, 16}) EXPECT_NO_THROW(tracker.observe(window(picture, 0, 0, size, size)));
  FeatureTrackerOptions none;
  none.features = 0;
  EXPECT_THROW(FeatureTracker{none}, std::invalid_argument);
}

}  // namespace
}  // namespace takt
