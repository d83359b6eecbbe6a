// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kalibr_folder.h"

#include <gtest/gtest.h>

#include "takt/recording/open_recording.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::TemporaryFolder;

const std::string picture = "P5\n2 2\n255\nabcd";  // a PGM; the name decides the stamp, the bytes the format
const std::string imu_rows =
    "timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z\n1385030208726607500,0.5,-0.1,0.02,9.1,0.2,-3.2\n"
    "1385030208731607500,0.6,-0.1,0.02,9.1,0.2,-3.2\n";

TEST(KalibrFolder, CamerasAndImusAsItsBagCreatorTakesThem) {
  const TemporaryFolder folder;
  (void)folder.file("cam0/1385030208776607488.png", picture);
  (void)folder.file("cam0/1385030208726607488.png", picture);
  (void)folder.file("cam0/notes.png", picture);
  (void)folder.file("cam1/1385030208726607488.png", picture);
  (void)folder.file("imu0.csv", imu_rows);
  const Recording r = open_recording(folder.path());
  EXPECT_EQ(r.format, "Kalibr folder");
  ASSERT_EQ(r.cameras.size(), 2u);
  ASSERT_EQ(r.cameras[0].size(), 2u);
  EXPECT_EQ(to_ns(r.cameras[0].stamps[0]), 1385030208726607488);
  EXPECT_EQ(r.cameras[1].name, "cam1");
  ASSERT_EQ(r.imus.size(), 1u);
  EXPECT_EQ(r.imus[0].name, "imu0");
  EXPECT_EQ(to_ns(r.imus[0].stamps[1]), 1385030208731607500);
  EXPECT_EQ(r.imus[0].gyro_rad_s[1].x(), 0.6);
  EXPECT_EQ(r.imus[0].accel_m_s2[0].z(), -3.2);
  EXPECT_EQ(r.imus[0].clock, r.cameras[0].clock);
  const auto frame = r.cameras[0].open()->next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image.width, 2);
  EXPECT_NE(r.notes.front().find("1 pictures have no stamp"), std::string::npos);
}

TEST(KalibrFolder, PicturesAloneAreOneCamera) {
  const TemporaryFolder folder;
  for (const char* name : {"left02.jpg", "left01.jpg", "left11.jpg"}) (void)folder.file(name, picture);
  const Recording r = open_recording(folder.path());
  EXPECT_EQ(r.format, "picture folder");
  ASSERT_EQ(r.cameras.size(), 1u);
  EXPECT_EQ(r.cameras[0].size(), 3u);
  EXPECT_TRUE(r.imus.empty());
  EXPECT_NE(r.notes.front().find("no stamps"), std::string::npos);
}

TEST(KalibrFolder, ABrokenImuFileIsNamed) {
  const TemporaryFolder folder;
  (void)folder.file("cam0/1385030208726607488.png", picture);
  (void)folder.file("imu0.csv", "timestamp,omega_x,omega_y,omega_z\n1,2,nope,4\n");
  EXPECT_NE(complaint([&] { (void)open_recording(folder.path()); }).find("imu0.csv"), std::string::npos);
}

}  // namespace
}  // namespace takt
