// SPDX-License-Identifier: Apache-2.0
// takt align on real recordings: what is known of them, and what happens when they are damaged.
#include "takt/workflows/align.h"

#include <gtest/gtest.h>

#include <sstream>

#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "tests/euroc.h"
#include "tests/tools.h"

namespace takt {
namespace {

namespace fs = std::filesystem;
using testing_tools::complaint;
using testing_tools::real_data;
using testing_tools::TemporaryFolder;

Estimate aligned(const std::string& path) {
  AlignJob job;
  job.inputs = {path};
  job.sensor = "cam0";
  return align(job).estimate;
}

TEST(AlignRecordings, MovedStampsMoveTheAnswerByExactlyThat) {
  TAKT_NEEDS_REAL_DATA("euroc_micro");
  const TemporaryFolder folder;
  const Estimate plain = aligned(real_data("euroc_micro"));
  ASSERT_TRUE(plain.answered());
  EXPECT_LT(std::abs(to_seconds(*plain.offset)), 1e-3);
  EXPECT_LT(std::abs(to_seconds(*plain.offset)), 4 * *plain.sigma_s);
  for (const double by_ms : {-120.0, -7.3, 33.0, 500.0}) {
    const Duration by = from_seconds(1e-3 * by_ms);
    const Estimate moved = aligned(testing_tools::euroc_with_stamps_moved(folder, by));
    ASSERT_TRUE(moved.answered()) << by_ms << " ms";
    EXPECT_LT(std::abs(to_seconds(*moved.offset + by - *plain.offset)), 0.2e-3) << by_ms << " ms";
    EXPECT_EQ(moved.verdict, plain.verdict) << by_ms << " ms";
  }
}

/// Cut short, or with bytes overwritten, a file is read as far as it goes or refused in one line; never anything else.
void expect_damage_is_survived(const std::string& path) {
  const TemporaryFolder folder;
  const std::string whole = read_file(path);
  const std::string name = fs::path(path).filename().string();
  std::vector<std::string> damaged;
  for (const double share : {0.0, 0.0001, 0.1, 0.37, 0.71, 0.9999})
    damaged.push_back(whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
  for (const std::size_t at : {std::size_t{0}, whole.size() / 3, whole.size() - whole.size() / 50 - 64}) {
    damaged.push_back(whole);
    damaged.back().replace(at, 64, 64, '\xA5');
  }
  for (const std::string& bytes : damaged) {
    const std::string file = folder.file(name, bytes);
    const std::string said = complaint([&] { (void)open_recording(file); });
    EXPECT_TRUE(!bytes.empty() || !said.empty()) << name << ": an empty file was read";
  }
}

TEST(AlignTracks, WithoutIntrinsicsSaySo) {
  const TemporaryFolder folder;
  std::string tracks = "t_ns,feature_id,u_px,v_px\n", imu = "t_ns,wx,wy,wz\n";
  for (int i = 0; i < 40; ++i) {
    tracks += std::to_string(50'000'000LL * i) + ",1,320,240\n";
    imu += std::to_string(10'000'000LL * i) + ",0.1,0.2,0.3\n";
  }
  (void)folder.file("cam0_tracks.csv", tracks);
  (void)folder.file("imu0.csv", imu);
  (void)folder.file("calib.yaml", "cam0:\n  resolution: [640, 480]\n");
  EXPECT_NE(complaint([&] { (void)aligned(folder.path()); }).find("cam0: has no intrinsics"), std::string::npos);
}

TEST(AlignRecordings, DamagedFilesAreRefusedInOneLine) {
  TAKT_NEEDS_REAL_DATA("gopro");
  for (const char* path :
       {"gopro/karma.mp4", "hero8_racebox/5f2167b0-racebox.csv", "phone_mcu_gyro/mcu_gyro_data.csv",
        "ros1_bags/example-bz2.bag", "ros1_bags/example-lz4.bag", "ros1_bags/phidgets_imu_upside_down.bag"}) {
    SCOPED_TRACE(path);
    expect_damage_is_survived(real_data(path));
  }
}

}  // namespace
}  // namespace takt
