// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/live_lines.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

std::string refusal(const char* line) {
  std::string why;
  EXPECT_FALSE(read_live_line(line, why)) << line;
  return why;
}

TEST(LiveLines, ReadsAnImuSample) {
  std::string why;
  const auto read =
      read_live_line(R"({"imu":"imu0","t_ns":1700000000123456789,"gyro":[0.1,-2,3e-3],"accel":[0,0,9.8]})", why);
  ASSERT_TRUE(read) << why;
  const auto& s = std::get<LiveImuSample>(*read);
  EXPECT_EQ(s.imu, "imu0");
  EXPECT_EQ(to_ns(s.stamp), 1700000000123456789);
  EXPECT_EQ(s.gyro_rad_s, Vec3(0.1, -2, 3e-3));
  EXPECT_EQ(s.accel_m_s2, Vec3(0, 0, 9.8));
}

TEST(LiveLines, ReadsAFrame) {
  std::string why;
  const auto read =
      read_live_line(R"({"cam":"cam0","t_ns":5,"exposure_s":0.004,"features":[[7,10.5,20],[9,1,2]]})", why);
  ASSERT_TRUE(read) << why;
  const auto& f = std::get<LiveFrame>(*read);
  EXPECT_EQ(f.exposure_s, 0.004);
  ASSERT_EQ(f.features.size(), 2u);
  EXPECT_EQ(f.features[0].id, 7);
  EXPECT_EQ(f.features[0].pixel, Vec2(10.5, 20));
}

TEST(LiveLines, SaysWhatIsWrong) {
  EXPECT_EQ(refusal("{"), "is no JSON object");
  EXPECT_EQ(refusal("[]"), "is no JSON object");
  EXPECT_EQ(refusal(R"({"imu":"a"})"), "has no whole number t_ns");
  EXPECT_EQ(refusal(R"({"imu":"a","t_ns":1.5})"), "has no whole number t_ns");
  EXPECT_EQ(refusal(R"({"imu":"a","t_ns":18446744073709551615})"), "has no whole number t_ns");
  EXPECT_NE(refusal(R"({"imu":"a","t_ns":1,"gyro":[1,2],"accel":[1,2,3]})").find("three gyro"), std::string::npos);
  EXPECT_NE(refusal(R"({"cam":"c","t_ns":1,"features":[[1,2]]})").find("features"), std::string::npos);
  EXPECT_EQ(refusal(R"({"t_ns":1})"), "has neither imu nor cam");
}

}  // namespace
}  // namespace takt
