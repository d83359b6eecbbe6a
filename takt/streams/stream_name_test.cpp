// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/stream_name.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

TEST(StreamName, PatternsMatchWholeNames) {
  EXPECT_TRUE(name_matches("cam0", "cam0"));
  EXPECT_FALSE(name_matches("cam0", "cam01"));
  EXPECT_TRUE(name_matches("/cam*/image_raw", "/camera/left/image_raw"));
  EXPECT_TRUE(name_matches("*imu*", "/imu"));
  EXPECT_TRUE(name_matches("cam?", "cam7"));
  EXPECT_FALSE(name_matches("cam?", "cam"));
  EXPECT_TRUE(name_matches("*a*b", "aXaXbXb"));
  EXPECT_FALSE(name_matches("*a*b", "aXaXbX"));
  EXPECT_TRUE(name_matches("*", ""));
  EXPECT_FALSE(name_matches("", "a"));
}

}  // namespace
}  // namespace takt
