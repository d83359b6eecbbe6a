// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/picture.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

namespace takt {
namespace {

std::vector<std::byte> png() {
  cv::Mat picture(48, 64, CV_8UC1);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) picture.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(x * y);
  std::vector<std::uint8_t> encoded;
  cv::imencode(".png", picture, encoded);
  const auto bytes = std::as_bytes(std::span(encoded));
  return {bytes.begin(), bytes.end()};
}

TEST(Picture, APngIsReadOnlyAsItWasWritten) {
  const std::vector<std::byte> whole = png();
  EXPECT_EQ(decode_picture(whole).width, 64);
  testing::internal::CaptureStderr();
  for (std::size_t at = 0; at < whole.size(); at += 7) {
    std::vector<std::byte> damaged = whole;
    damaged[at] ^= std::byte{0x20};
    EXPECT_TRUE(decode_picture(damaged).empty()) << at;
    EXPECT_TRUE(decode_picture(std::span(whole).first(at)).empty()) << at;
  }
  // The decoder says nothing of its own.
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace takt
