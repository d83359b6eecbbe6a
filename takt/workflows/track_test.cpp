// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/track.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/test_paths.h"
#include "takt/workflows/align.h"
#include "takt/workflows/apply.h"
#include "takt/workflows/simulate.h"
#include "tests/euroc.h"
#include "tests/tools.h"

namespace fs = std::filesystem;

namespace takt {
namespace {

class Track : public testing::Test {
 protected:
  void SetUp() override { fs::remove_all(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  Estimate simulate(ParameterChanges changes) const {
    changes["tracks"] = "true";
    SimulationRequest request;
    request.folder = folder_;
    request.changes = std::move(changes);
    request.seed = 4;
    return simulation_kinds().front().write(request);
  }
  TrackJob job() const {
    TrackJob j;
    j.input = folder_;
    return j;
  }

  std::string folder_ = (fs::path(testing::TempDir()) / "takt_track_test").string();
};

TEST_F(Track, AnswersFromAFolderAndDrawsTheTruth) {
  const Estimate truth = simulate({{"duration_s", "6"}});
  std::size_t lines = 0, poses = 0;
  TrackJob j = job();
  j.on_estimate = [&](const OffsetNow&) { ++lines; };
  j.on_pose = [&](const PoseNow&) { ++poses; };
  const Estimate e = track(j).estimate;
  ASSERT_TRUE(e.answered());
  EXPECT_LT(std::abs(to_seconds(*e.offset - *truth.offset)), 4 * *e.sigma_s);
  EXPECT_TRUE(e.pieces.empty());
  ASSERT_EQ(e.evidence.panels.size(), 1u);
  EXPECT_EQ(e.evidence.panels[0].y.size(), 2u);
  EXPECT_GT(lines, 40u);
  EXPECT_EQ(lines, poses);
}

TEST_F(Track, GivesPiecesWhereTheOffsetSteps) {
  const Estimate truth = simulate({{"duration_s", "20"}, {"step_s", "0.02"}, {"step_at_s", "10"}});
  const Estimate e = track(job()).estimate;
  ASSERT_TRUE(e.answered());
  ASSERT_EQ(e.pieces.size(), 2u);
  EXPECT_NEAR(to_seconds(e.pieces[1].offset - e.pieces[0].offset), 0.02, 1e-3);
  EXPECT_NEAR(seconds_since(truth.pieces[1].start, e.pieces[1].start), 0, 3);
}

TEST_F(Track, AMovingOffsetAppliedLeavesNone) {
  simulate({{"duration_s", "30"}, {"drift_ppm", "75"}, {"step_s", "0.02"}, {"step_at_s", "15"}});
  ApplyJob taken;
  taken.result = track(job()).estimate;
  ASSERT_EQ(taken.result.pieces.size(), 2u);
  const testing_tools::TemporaryFolder beside;
  taken.in = folder_, taken.out = beside.path() + "/applied";
  (void)apply(taken);
  AlignJob left;
  left.inputs = {taken.out};
  // Both ends, each with one piece only.
  for (const auto& [from_s, to_s] : {std::pair{2.0, 14.0}, std::pair{18.0, 29.0}}) {
    left.open.from_s = from_s, left.open.to_s = to_s;
    const Estimate e = align(left).estimate;
    ASSERT_TRUE(e.answered()) << from_s;
    EXPECT_LT(std::abs(to_seconds(*e.offset)), 3e-4) << from_s;
    EXPECT_LT(std::abs(e.drift.value_or(0)), 40e-6) << from_s;
  }
}

TEST_F(Track, FollowsBothCamerasOfPicturesAndTheirShifts) {
  TAKT_NEEDS_REAL_DATA("euroc_micro");
  TrackJob j;
  j.input = testing_tools::real_data("euroc_micro");
  const Estimate plain = track(j).estimate;
  ASSERT_EQ(plain.estimates.size(), 2u);
  for (const Estimate& e : plain.estimates) {
    ASSERT_TRUE(e.answered()) << e.sensor;
    EXPECT_LT(std::abs(to_seconds(*e.offset)), 4 * *e.sigma_s) << e.sensor;
  }
  const testing_tools::TemporaryFolder folder;
  const Duration by = from_seconds(0.0123);
  j.input = testing_tools::euroc_with_stamps_moved(folder, by);
  j.sensor = "cam0";
  const Estimate moved = track(j).estimate;
  ASSERT_TRUE(moved.answered());
  EXPECT_LT(std::abs(to_seconds(*moved.offset + by - *plain.offset)), 2e-4);
}

TEST_F(Track, ListensToAPipe) {
  simulate({{"duration_s", "5"}});
  const std::string rig = folder_ + "/calib.yaml";
  // The folder's rows as lines, in order of their stamps.
  std::multimap<long long, std::string> lines;
  std::istringstream imu(read_file(folder_ + "/imu0.csv")), cam(read_file(folder_ + "/cam0_tracks.csv"));
  std::string row;
  std::getline(imu, row), std::getline(cam, row);
  while (std::getline(imu, row)) {
    std::vector<std::string> cells;
    std::istringstream in(row);
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
    lines.emplace(std::stoll(cells[0]), "{\"imu\":\"imu0\",\"t_ns\":" + cells[0] + ",\"gyro\":[" + cells[1] + "," +
                                            cells[2] + "," + cells[3] + "],\"accel\":[" + cells[4] + "," + cells[5] +
                                            "," + cells[6] + "]}");
  }
  std::map<std::string, std::string> frames;
  while (std::getline(cam, row)) {
    const auto comma = row.find(',');
    std::string& features = frames[row.substr(0, comma)];
    features += (features.empty() ? "[" : ",[") + row.substr(comma + 1) + "]";
  }
  for (const auto& [stamp, features] : frames)
    lines.emplace(std::stoll(stamp), "{\"cam\":\"cam0\",\"t_ns\":" + stamp + ",\"features\":[" + features + "]}");
  std::stringstream pipe;
  for (const auto& [stamp, line] : lines) pipe << line << "\n";
  pipe << "garbage\n";
  TrackJob live = job();
  live.input = "-";
  EXPECT_THROW((void)track_live(live, pipe), Error);  // no rig
  live.rig = rig;
  const Estimate heard = track_live(live, pipe).estimate, read = track(job()).estimate;
  ASSERT_TRUE(heard.answered());
  EXPECT_NEAR(to_seconds(*heard.offset - *read.offset), 0, *read.sigma_s);
  EXPECT_NE(heard.notes.back().find("1 of"), std::string::npos) << heard.notes.back();
}

TEST_F(Track, FindsTheOffsetOfARecordedWalk) {
  const std::string path = TAKT_DATA_DIR "/vio_tracks/c01_corridor_p5";
  if (!fs::exists(path)) GTEST_SKIP() << "no recordings at " << path;
  TrackJob j = job();
  j.input = path;
  j.open.to_s = 12;
  const Estimate e = track(j).estimate;
  ASSERT_TRUE(e.answered());
  EXPECT_LT(std::abs(to_seconds(*e.offset) - 0.005), 3 * *e.sigma_s);
  EXPECT_LT(*e.sigma_s, 1e-4);
}

}  // namespace
}  // namespace takt
