// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/tracks_folder.h"

#include <gtest/gtest.h>

#include <map>

#include "takt/recording/open_recording.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::real_data;
using testing_tools::TemporaryFolder;

TrackStream tracks(const std::string& csv, const std::string& yaml = "") {
  std::vector<std::string> notes;
  return read_tracks(csv, yaml, "cam0", "run", notes);
}

TEST(TracksFolder, AFeatureThatComesBackHasANewId) {
  const TrackStream t =
      tracks("t,id,u,v\n100,7,1,1\n100,3,2,2\n200,3,2,2\n300,7,1,1\n300,3,2,2\n400,7,1,1\n500,3,9,9\n");
  ASSERT_EQ(t.size(), 5u);
  EXPECT_EQ(t.features[0][0].id, 3);  // sorted by id
  EXPECT_EQ(t.features[0][1].id, 7);
  EXPECT_EQ(t.features[2][0].id, 3);
  EXPECT_EQ(t.features[2][1].id, 8);
  EXPECT_EQ(t.features[3][0].id, 8);
  EXPECT_EQ(t.features[4][0].id, 9);
}

TEST(TracksFolder, CalibrationOfEachCamera) {
  const TrackStream t = tracks("t,id,u,v\n1,1,1,1\n",
                               "cam1:\n  intrinsics: [1, 1, 1, 1]\ncam0:\n  resolution: [640, 480]\n"
                               "  intrinsics: [400, 401, 320, 240]\n  pixel_noise_sigma: 0.5\n"
                               "  rolling_shutter_line_delay_s: 5.0e-5\n");
  EXPECT_EQ(t.model.fy, 401);
  EXPECT_EQ(t.pixel_sigma, 0.5);
  EXPECT_EQ(t.timing.shutter, Shutter::rolling);
  EXPECT_DOUBLE_EQ(t.timing.readout_s, 480 * 5e-5);
}

TEST(TracksFolder, BadInputIsOneLine) {
  EXPECT_NE(complaint([] { (void)tracks("1,2,3\n"); }).find("cam0_tracks.csv: has 3 columns"), std::string::npos);
  EXPECT_NE(complaint([] { (void)tracks("1,1,3,4\n1,1,3,4\n"); }).find("feature 1 is listed twice"), std::string::npos);
  EXPECT_NE(complaint([] { (void)tracks("1,1,nan,4\n"); }).find("cam0_tracks.csv:1"), std::string::npos);
  EXPECT_NE(complaint([] { (void)tracks("1,1,3,4\n", "cam0: 5\n"); }).find("cam0 is not a map"), std::string::npos);
}

TEST(TracksFolder, RealCases) {
  TAKT_NEEDS_REAL_DATA("vio_tracks");
  const struct {
    const char* name;
    std::size_t imu, frames, observations;
  } cases[] = {{"c01_corridor_p5", 24000, 600, 71987},
               {"c03_gore_p50", 12000, 1200, 144000},
               {"c06_neighborhood_m33", 12000, 600, 72000}};
  for (const auto& c : cases) {
    const Recording r = open_recording(real_data(std::string("vio_tracks/") + c.name));
    EXPECT_EQ(r.format, "tracks folder");
    ASSERT_EQ(r.imus.size(), 1u);
    ASSERT_EQ(r.tracks.size(), 1u);
    EXPECT_EQ(r.imus[0].size(), c.imu);
    EXPECT_EQ(r.imus[0].noise->gyro_density, 0.00016968);
    const TrackStream& t = r.tracks[0];
    EXPECT_EQ(t.size(), c.frames);
    EXPECT_EQ(t.pixel_sigma, 1.0);
    EXPECT_EQ(t.timing.shutter, Shutter::global);
    EXPECT_EQ(t.model.distortion, Distortion::radtan);
    EXPECT_NEAR((*t.T_body_cam)(2, 3), 0.009810730589, 1e-12);

    // An id that is in two frames is in every frame between them.
    std::map<std::int64_t, std::size_t> last_frame;
    std::size_t observations = 0;
    for (std::size_t i = 0; i < t.size(); ++i)
      for (const TrackedFeature& f : t.features[i]) {
        ++observations;
        const auto [known, is_new] = last_frame.emplace(f.id, i);
        ASSERT_TRUE(is_new || known->second + 1 == i) << "id " << f.id << " skips a frame before " << i;
        known->second = i;
      }
    EXPECT_EQ(observations, c.observations);
  }
}

}  // namespace
}  // namespace takt
