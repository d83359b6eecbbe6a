// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gcsv.h"

#include <gtest/gtest.h>

#include "takt/recording/open_recording.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::TemporaryFolder;

TEST(Gcsv, ScalesAndOrientationOfTheHeader) {
  const TemporaryFolder folder;
  const Recording r = open_recording(folder.file("clip.gcsv",
                                                 "GYROFLOW IMU LOG\r\nversion,1.3\r\norientation,YxZ\r\n"
                                                 "frame_readout_time,15.23\r\ntscale,0.000001\r\ngscale,0.001\r\n"
                                                 "ascale,0.5\r\nt,gx,gy,gz,ax,ay,az\r\n1644159993000001,1,2,3,4,5,6\r\n"
                                                 "1644159993002001,10,20,30,0,0,2\r\n"));
  EXPECT_EQ(r.format, "gyroflow log");
  ASSERT_EQ(r.imus.size(), 1u);
  const ImuStream& imu = r.imus[0];
  EXPECT_EQ(imu.name, "clip");
  EXPECT_EQ(to_ns(imu.stamps.at(0)), 1'644'159'993'000'001'000);
  EXPECT_LT((imu.gyro_rad_s[0] - Vec3(0.002, -0.001, 0.003)).norm(), 1e-15);
  EXPECT_LT((imu.accel_m_s2[1] - Vec3(0, 0, 9.80665)).norm(), 1e-12);
  EXPECT_NE(r.notes.back().find("15.23 ms"), std::string::npos);
}

TEST(Gcsv, AMirrorIsNoRotationAndDefaultsAreMilliseconds) {
  const Recording r = read_gcsv("GYROFLOW IMU LOG\norientation,xYZ\nt,gx,gy,gz\n1.5,1,2,3\n2.5,1,2,3\n", "a.gcsv");
  EXPECT_EQ(to_ns(r.imus.at(0).stamps.at(0)), 1'500'000);
  EXPECT_EQ(r.imus[0].gyro_rad_s[0], Vec3(1, 2, 3));
  EXPECT_TRUE(r.imus[0].accel_m_s2.empty());
  EXPECT_NE(r.notes.at(0).find("no rotation"), std::string::npos);
}

TEST(Gcsv, BrokenLogsSayWhy) {
  const auto said = [](const char* text) { return complaint([&] { (void)read_gcsv(text, "a.gcsv"); }); };
  EXPECT_NE(said("GYROFLOW IMU LOG\nversion,1\n").find("no line t,gx"), std::string::npos);
  EXPECT_NE(said("GYROFLOW IMU LOG\ntscale,abc\nt,gx,gy,gz\n1,1,1,1\n").find("tscale"), std::string::npos);
  EXPECT_NE(said("GYROFLOW IMU LOG\ngscale,0\nt,gx,gy,gz\n1,1,1,1\n").find("gscale"), std::string::npos);
  EXPECT_NE(said("GYROFLOW IMU LOG\nt,gx,gy,gz\n1,1,1\n"), "");
  EXPECT_NE(said("GYROFLOW IMU LOG\ntscale,1\nt,gx,gy,gz\n99999999999,1,1,1\n"), "");
  EXPECT_NE(said("GYROFLOW IMU LOG\ntscale,2\nt,gx,gy,gz\n9999999999,1,1,1\n").find("64-bit"), std::string::npos);
  EXPECT_EQ(
      to_ns(read_gcsv("GYROFLOW IMU LOG\ntscale,0.0025\nt,gx,gy,gz\n4,1,1,1\n", "a.gcsv").imus.at(0).stamps.at(0)),
      10'000'000);
}

}  // namespace
}  // namespace takt
