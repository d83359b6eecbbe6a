// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/frame_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "takt/error.h"
#include "takt/test_paths.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

/// Ten stamps 33.3 ms apart, gyro, and pictures numbered 4 to 6 (one grey pixel each).
class FrameFolder : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "frames");
    std::ofstream stamps(folder_ / "framestamp.txt");
    for (int i = 0; i < 10; ++i) stamps << "4.32804042" << 6246 + 33 * i << "000454e+06\n";
    std::ofstream(folder_ / "gyro.txt")
        << "0.1,0.2,0.3,4.328040426741000265e+06\n0.4,0.5,0.6,4.328040429166999646e+06\n";
    for (int n = 4; n <= 6; ++n)
      std::ofstream(folder_ / "frames" / ("RE_frame-" + std::to_string(n) + ".pgm.png"), std::ios::binary)
          << "P5 1 1 255\n"
          << static_cast<char>(40 * n);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void log(int first) const {
    std::ofstream dump(folder_ / "gyro_dump.txt");
    for (int i = 0; i < 10; ++i)
      dump << "SOF  432804042" << 6246 + 33 * i << ",  frameNum :" << first + i << " exp time 0.00" << 51 + i << "\n"
           << "frameid:1 gyro:0 x 0.1 y 0.2 z 0.3 ts 4328040426741\n";
  }
  std::string path() const { return folder_.string(); }

  fs::path folder_ = fs::path(testing::TempDir()) / ("takt_frames_" + std::to_string(::getpid()));
};

TEST_F(FrameFolder, NumbersPairWithStampsCountedFromOne) {
  ASSERT_TRUE(looks_like_frame_folder(path()));
  log(1);
  const Recording r = read_frame_folder(path(), {});
  const CameraStream& cam = r.cameras.at(0);
  ASSERT_EQ(cam.size(), 3u);
  EXPECT_EQ(to_ns(cam.stamps[0]), 4'328'040'426'345'000);  // the 4th
  EXPECT_EQ(cam.exposures_s, (std::vector<double>{0.0054, 0.0055, 0.0056}));
  EXPECT_EQ(cam.timing.instant, ExposureInstant::start);
  EXPECT_EQ(cam.clock, r.imus.at(0).clock);
  ASSERT_EQ(r.imus[0].size(), 2u);
  EXPECT_EQ(to_ns(r.imus[0].stamps[1]), 4'328'040'429'167'000);
  EXPECT_EQ(r.imus[0].gyro_rad_s[1], Vec3(0.4, 0.5, 0.6));
}

TEST_F(FrameFolder, AShiftIsObeyedAndSaid) {
  log(1);
  OpenOptions options;
  options.frame_shift = 1;
  const Recording r = read_frame_folder(path(), options);
  EXPECT_EQ(to_ns(r.cameras.at(0).stamps[0]), 4'328'040'426'378'000);
  EXPECT_EQ(r.cameras[0].exposures_s[0], 0.0055);
  EXPECT_NE(r.notes[1].find("N+1"), std::string::npos) << r.notes[1];
  options.frame_shift = 5;  // 4 to 6 become 9 to 11: one too many
  EXPECT_EQ(read_frame_folder(path(), options).cameras.at(0).size(), 2u);
  options.frame_shift = 50;
  EXPECT_THROW((void)read_frame_folder(path(), options), Error);
}

TEST_F(FrameFolder, ALogThatCountsOtherwiseIsNotBelieved) {
  log(0);
  const Recording r = read_frame_folder(path(), {});
  EXPECT_TRUE(r.cameras.at(0).exposures_s.empty());
  EXPECT_NE(r.notes[1].find("nothing in the folder confirms"), std::string::npos) << r.notes[1];
}

TEST_F(FrameFolder, BrokenFoldersAreErrors) {
  std::ofstream(folder_ / "gyro.txt") << "0.1,0.2,4.3e6\n0.1,0.2,4.4e6\n";
  EXPECT_THROW((void)read_frame_folder(path(), {}), Error);
  fs::remove_all(folder_ / "frames");
  EXPECT_THROW((void)read_frame_folder(path(), {}), Error);
  fs::remove(folder_ / "framestamp.txt");
  EXPECT_FALSE(looks_like_frame_folder(path()));
}

TEST(FrameNumber, IsTheLastRunOfDigits) {
  EXPECT_EQ(number_in("RE_frame-99"), 99);
  EXPECT_EQ(number_in("2020-01-02_000123"), 123);
  EXPECT_EQ(number_in("7"), 7);
  EXPECT_EQ(number_in("frame"), std::nullopt);
  EXPECT_EQ(number_in("99999999999999999999999"), std::nullopt);
}

TEST(FrameLog, OtherLinesArePassedOver) {
  const auto log = read_frame_log(
      "SOF  12,  frameNum :3 exp time 0.005\nSOF x\n\nframeid:1 gyro:0\nSOF  13, frameNum :4 exp time -1");
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log.at(3).start, from_ns(12'000));
  EXPECT_EQ(log.at(3).exposure_s, 0.005);
}

TEST(FrameFolderReal, PhoneWithRollingShutter) {
  const std::string path = TAKT_DATA_DIR "/phone_rolling_shutter";
  if (!fs::exists(path)) GTEST_SKIP() << "no recording at " << path;
  const Recording r = read_frame_folder(path, {});
  const CameraStream& cam = r.cameras.at(0);
  ASSERT_EQ(cam.size(), 103u);
  EXPECT_EQ(to_ns(cam.stamps[0]), 4'328'043'690'897'000) << "SOF of frameNum 99";
  for (const double e : cam.exposures_s) EXPECT_TRUE(e > 0.0048 && e < 0.0060) << e;
  EXPECT_EQ(r.imus.at(0).size(), 29466u);
  const auto reader = cam.open();
  std::size_t frames = 0;
  while (auto frame = reader->next()) {
    EXPECT_EQ(frame->image.height, cam.timing.rows);
    ++frames;
  }
  EXPECT_EQ(frames, 103u);
}

}  // namespace
}  // namespace takt
