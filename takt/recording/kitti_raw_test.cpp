// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kitti_raw.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "takt/recording/kitti_calibration.h"
#include "takt/recording/open_recording.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::TemporaryFolder;

constexpr std::int64_t first_ns = 1'317'042'145'964'389'445;  // date -u -d '2011-09-26 13:02:25'

// A made-up day with lenses as strong as KITTI's, and axes as its car has them.
const char* const cam_to_cam =
    "calib_time: 01-Jan-2020 10:00:00\ncorner_dist: 9.9e-02\n"
    "S_02: 1.392e+03 5.12e+02\nK_02: 9.6e+02 0 7.0e+02 0 9.5e+02 2.2e+02 0 0 1\n"
    "D_02: -3.7e-01 2.0e-01 1.5e-03 2.0e-03 -7.0e-02\n"
    "R_02: 0.8 0 0.6 0 1 0 -0.6 0 0.8\nT_02: 5.9e-02 -7.5e-04 2.0e-02\n"
    "S_rect_02: 1.242e+03 3.75e+02\nR_rect_02: 1 0 0 0 1 0 0 0 1\nR_rect_00: 1 0 0 0 0.8 -0.6 0 0.6 0.8\n"
    "P_rect_02: 7.2e+02 0 6.1e+02 4.5e+01 0 7.2e+02 1.7e+02 2.2e-01 0 0 1 2.7e-03\n";
const char* const imu_to_velo = "calib_time: 01-Jan-2020\nR: 1 0 0 0 1 0 0 0 1\nT: -0.81 0.32 -0.8\n";
const char* const velo_to_cam = "calib_time: 01-Jan-2020\nR: 0 -1 0 0 0 -1 1 0 0\nT: -0.004 -0.076 -0.27\n";

std::string picture(int width, int height) {
  return fmt::format("P5\n{} {}\n255\n", width, height) + std::string(static_cast<std::size_t>(width * height), 'x');
}
/// Each number is its own column, so that a wrong column shows.
std::string oxts_row(double more) {
  std::string row;
  for (int i = 0; i < 30; ++i) row += fmt::format("{}{}", i == 0 ? "" : " ", i + more);
  return row + "\n";
}

struct Drive {
  TemporaryFolder day;
  explicit Drive(int width = 1242, int height = 375) {
    (void)day.file("calib_cam_to_cam.txt", cam_to_cam);
    (void)day.file("calib_imu_to_velo.txt", imu_to_velo);
    (void)day.file("calib_velo_to_cam.txt", velo_to_cam);
    (void)day.file("drive/image_02/timestamps.txt",
                   "2011-09-26 13:02:25.964389445\r\n2011-09-26 13:02:26.074397448\r\n2011-09-26 13:02:26.2\r\n");
    (void)day.file("drive/image_02/data/0000000000.png", picture(width, height));
    (void)day.file("drive/image_02/data/0000000001.png", picture(width, height));
    (void)day.file("drive/oxts/timestamps.txt", "2011-09-26 13:02:25.000000001\n\n2011-09-26 13:02:25.02\n");
    (void)day.file("drive/oxts/data/0000000000.txt", oxts_row(0));
    (void)day.file("drive/oxts/data/0000000002.txt", oxts_row(0.25));
  }
  [[nodiscard]] std::string path() const { return day.path() + "/drive"; }
};

bool says(const Recording& r, const std::string& what) {
  for (const std::string& note : r.notes)
    if (note.find(what) != std::string::npos) return true;
  return false;
}
Vec3 in_camera(const CameraStream& camera, const Vec3& p_imu) {
  return (camera.T_body_cam->inverse() * p_imu.homogeneous()).head<3>();
}
Mat4 matrix(const Mat3& r, const Vec3& t) {
  Mat4 m = Mat4::Identity();
  m.topLeftCorner<3, 3>() = r;
  m.topRightCorner<3, 1>() = t;
  return m;
}
/// From the inertial unit to the first camera, written down again from the files above.
Mat4 cam0_from_imu() {
  Mat3 turn;
  turn << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return matrix(turn, {-0.004, -0.076, -0.27}) * matrix(Mat3::Identity(), {-0.81, 0.32, -0.8});
}
const Vec3 ahead(20, -3, 1.5);  // m: forward, left, up

TEST(KittiRaw, StampsAndRows) {
  const Drive drive;
  const Recording r = open_recording(drive.path());
  EXPECT_EQ(r.format, "KITTI raw drive");
  ASSERT_EQ(r.cameras.size(), 1u);
  ASSERT_EQ(r.cameras[0].size(), 2u);
  EXPECT_EQ(to_ns(r.cameras[0].stamps[0]), first_ns);
  EXPECT_EQ(to_ns(r.cameras[0].stamps[1]) - first_ns, 110'008'003);
  EXPECT_TRUE(says(r, "image_02: 1 of 3 stamps have no file"));
  ASSERT_EQ(r.imus.size(), 1u);
  ASSERT_EQ(r.imus[0].size(), 2u);
  EXPECT_EQ(to_ns(r.imus[0].stamps[1]) - to_ns(r.imus[0].stamps[0]), 19'999'999);
  EXPECT_EQ(r.imus[0].gyro_rad_s[1], Vec3(17.25, 18.25, 19.25));
  EXPECT_EQ(r.imus[0].accel_m_s2[0], Vec3(11, 12, 13));
  EXPECT_EQ(r.imus[0].clock, r.cameras[0].clock);
  EXPECT_FALSE(says(r, "oxts_imu"));  // a blank line is nothing missing
}

TEST(KittiRaw, RectifiedPicturesProjectAsTheDevelopmentKitSays) {
  const Drive drive;
  const CameraStream camera = open_recording(drive.path()).cameras.at(0);
  // x = P_rect · R_rect · T_velo_to_cam · T_imu_to_velo · X
  Mat4 level = Mat4::Identity();
  level.block<2, 2>(1, 1) << 0.8, -0.6, 0.6, 0.8;
  Eigen::Matrix<double, 3, 4> P;
  P << 720, 0, 610, 45, 0, 720, 170, 0.22, 0, 0, 1, 0.0027;
  const Vec3 x = P * level * cam0_from_imu() * ahead.homogeneous();
  ASSERT_TRUE(camera.model);
  EXPECT_EQ(camera.model->distortion, Distortion::none);
  EXPECT_LT((*camera.model->project(in_camera(camera, ahead)) - x.hnormalized()).norm(), 1e-9);
}

TEST(KittiRaw, PicturesAsTakenKeepTheirThirdRadialTermAsWellAsItCanBeSaid) {
  const Drive drive(1392, 512);
  const Recording r = open_recording(drive.path());
  ASSERT_TRUE(r.cameras.at(0).model);
  const CameraModel& m = *r.cameras[0].model;
  Mat3 turn;
  turn << 0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8;
  const Vec3 expected = (matrix(turn, {0.059, -7.5e-4, 0.02}) * cam0_from_imu() * ahead.homogeneous()).head<3>();
  EXPECT_LT((in_camera(r.cameras[0], ahead) - expected).norm(), 1e-12);

  const auto said = std::find_if(r.notes.begin(), r.notes.end(),
                                 [](const std::string& n) { return n.find("k3 put into") != std::string::npos; });
  ASSERT_NE(said, r.notes.end());
  const double bound_px = std::stod(said->substr(said->find("at most ") + 8));
  EXPECT_LT(bound_px, 1);
  double worst = 0;
  for (double x = -0.7; x <= 0.7; x += 0.05)
    for (double y = -0.2; y <= 0.3; y += 0.05) {
      const double r2 = x * x + y * y, k = 1 + r2 * (-0.37 + r2 * (0.2 + r2 * -0.07));
      const Vec2 seen(700 + 960 * (x * k + 2 * 1.5e-3 * x * y + 2e-3 * (r2 + 2 * x * x)),
                      220 + 950 * (y * k + 1.5e-3 * (r2 + 2 * y * y) + 2 * 2e-3 * x * y));
      const auto pixel = m.project(Vec3(x, y, 1));
      ASSERT_TRUE(pixel);
      worst = std::max(worst, (*pixel - seen).norm());
    }
  EXPECT_LE(worst, 1.06 * bound_px);  // the bound is said with two digits
  EXPECT_GT(worst, 0.3 * bound_px);
}

TEST(KittiRaw, OtherPicturesOrNoCalibrationLeaveTheLensUnknown) {
  const Drive drive(100, 80);
  const Recording r = open_recording(drive.path());
  EXPECT_FALSE(r.cameras.at(0).model);
  EXPECT_FALSE(r.cameras[0].T_body_cam);
  EXPECT_TRUE(says(r, "no calibration for its pictures of 100 by 80"));
  std::filesystem::remove(drive.day.path() + "/calib_cam_to_cam.txt");
  EXPECT_TRUE(says(open_recording(drive.path() + "/"), "no calib_cam_to_cam.txt"));
}

TEST(KittiRaw, WhatIsBrokenIsNamed) {
  const Drive drive;
  const auto complains = [&](const std::string& file, const std::string& text, const std::string& about) {
    const std::string before = drive.day.path() + "/" + file;
    std::ifstream in(before, std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(in), {}};
    (void)drive.day.file(file, text);
    const std::string said = complaint([&] { (void)open_recording(drive.path()); });
    EXPECT_NE(said.find(about), std::string::npos) << said;
    (void)drive.day.file(file, good);
  };
  complains("drive/image_02/timestamps.txt", "2011-09-26 13:02:25.9\n2011-13-26 13:02:25\n", "timestamps.txt:2");
  complains("drive/image_02/timestamps.txt", "1317042145964389445\n", "no date and time");
  complains("drive/oxts/data/0000000002.txt", "1 2 3 4 5 6 7 8 9 10 11 12 13 14", "has 14 numbers");
  complains("drive/oxts/data/0000000002.txt", oxts_row(0).replace(oxts_row(0).find("18"), 2, "nan"), "'nan'");
  complains("calib_velo_to_cam.txt", "R: 2 0 0 0 1 0 0 0 1\nT: 0 0 0\n", "R is not a rotation");
  complains("calib_cam_to_cam.txt", "S_rect_02: 1242 375\nP_rect_02: 1 2 3\n", "has 3 numbers, 12 expected");
  EXPECT_EQ(complaint([&] { (void)open_recording(drive.path()); }), "");
}

}  // namespace
}  // namespace takt
