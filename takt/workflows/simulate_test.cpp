// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/simulate.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "takt/error.h"
#include "takt/recording/open_recording.h"
#include "takt/simulation/folder_writer.h"
#include "takt/simulation/handheld_parameters.h"
#include "takt/test_paths.h"

namespace fs = std::filesystem;

namespace takt {
namespace {

class Simulate : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(root_);
    fs::create_directories(root_);
    request_.folder = (root_ / "made").string();
    request_.changes = {{"duration_s", "1"}, {"resolution", "160x120"}};
  }
  void TearDown() override { fs::remove_all(root_); }

  static const SimulationKind& kind(const std::string& name) {
    for (const SimulationKind& k : simulation_kinds())
      if (k.name == name) return k;
    throw std::logic_error("no kind " + name);
  }
  Estimate run() { return kind("handheld").write(request_); }
  std::string text(const std::string& name) const {
    std::ifstream in(fs::path(request_.folder) / name);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
  }
  /// The same recording, in memory.
  SimulatedRecording in_memory() const {
    HandheldParameters p;
    change(p, request_.changes);
    HandheldOptions o = to_options(p);
    o.seed = request_.seed;
    return simulate_handheld(o);
  }
  std::string scenario(const std::string& content) const {
    const std::string path = (root_ / "scenario.yaml").string();
    std::ofstream(path) << content;
    return path;
  }

  fs::path root_ = fs::path(testing::TempDir()) / "takt_simulate_test";
  SimulationRequest request_;
};

void expect_same(const ImuStream& read, const ImuStream& made) {
  EXPECT_EQ(read.stamps, made.stamps);
  EXPECT_EQ(read.gyro_rad_s, made.gyro_rad_s);
  EXPECT_EQ(read.accel_m_s2, made.accel_m_s2);
  ASSERT_TRUE(read.noise);
  EXPECT_EQ(read.noise->gyro_density, made.noise->gyro_density);
}

void expect_same(const CameraModel& read, const CameraModel& made) {
  EXPECT_EQ(read.width, made.width);
  EXPECT_EQ(read.height, made.height);
  EXPECT_EQ(read.fx, made.fx);
  EXPECT_EQ(read.cy, made.cy);
  EXPECT_EQ(read.distortion, made.distortion);
  EXPECT_EQ(read.coeffs, made.coeffs);
}

TEST_F(Simulate, AnAslFolderReadsBackAsItWasMade) {
  request_.changes["radtan"] = "true";
  request_.changes["stamp"] = "start";
  request_.changes["exposure_swing"] = "0.3";
  request_.changes["rolling_shutter_s"] = "0.02";
  static_cast<void>(run());
  const Recording read = open_recording(request_.folder);
  const Recording made = in_memory().recording;
  ASSERT_EQ(read.imus.size(), 1u);
  ASSERT_EQ(read.cameras.size(), 1u);
  expect_same(read.imus.front(), made.imus.front());
  const CameraStream &cam = read.cameras.front(), &wanted = made.cameras.front();
  EXPECT_EQ(cam.stamps, wanted.stamps);
  ASSERT_EQ(cam.exposures_s.size(), wanted.exposures_s.size());
  for (std::size_t i = 0; i < cam.size(); ++i) EXPECT_NEAR(cam.exposures_s[i], wanted.exposures_s[i], 1e-9);
  ASSERT_TRUE(cam.model);
  expect_same(*cam.model, *wanted.model);
  ASSERT_TRUE(cam.T_body_cam);
  EXPECT_TRUE(cam.T_body_cam->isApprox(*wanted.T_body_cam, 1e-12));
  EXPECT_EQ(cam.timing.instant, ExposureInstant::start);
  EXPECT_EQ(cam.timing.shutter, Shutter::rolling);
  EXPECT_EQ(cam.timing.readout_s, 0.02);
  EXPECT_EQ(cam.timing.exposure_s, wanted.timing.exposure_s);
  const auto reader = cam.open(), rendered = wanted.open();
  std::size_t frames = 0;
  for (; const auto frame = reader->next(); ++frames) {
    const auto original = rendered->next();
    ASSERT_TRUE(original);
    for (int y = 0; y < frame->image.height; ++y)
      ASSERT_TRUE(std::equal(frame->image.row(y), frame->image.row(y) + frame->image.width, original->image.row(y)));
  }
  EXPECT_EQ(frames, wanted.size());
}

TEST_F(Simulate, ATracksFolderReadsBackAsItWasMade) {
  request_.changes["tracks"] = "true";
  request_.changes["fisheye"] = "true";
  request_.changes["stamp"] = "end";
  request_.changes["rolling_shutter_s"] = "0.03";
  static_cast<void>(run());
  const Recording read = open_recording(request_.folder);
  const Recording made = in_memory().recording;
  ASSERT_EQ(read.imus.size(), 1u);
  ASSERT_EQ(read.tracks.size(), 1u);
  expect_same(read.imus.front(), made.imus.front());
  const TrackStream &cam = read.tracks.front(), &wanted = made.tracks.front();
  EXPECT_EQ(cam.stamps, wanted.stamps);
  expect_same(cam.model, wanted.model);
  EXPECT_EQ(cam.pixel_sigma, wanted.pixel_sigma);
  EXPECT_NEAR(cam.timing.readout_s, 0.03, 1e-15);
  EXPECT_EQ(cam.timing.instant, ExposureInstant::end);
  EXPECT_EQ(cam.timing.exposure_s, wanted.timing.exposure_s);
  ASSERT_EQ(cam.features.size(), wanted.features.size());
  for (std::size_t i = 0; i < cam.size(); ++i) {
    ASSERT_EQ(cam.features[i].size(), wanted.features[i].size());
    for (std::size_t k = 0; k < cam.features[i].size(); ++k) {
      EXPECT_EQ(cam.features[i][k].id, wanted.features[i][k].id);
      EXPECT_LT((cam.features[i][k].pixel - wanted.features[i][k].pixel).norm(), 1e-4);
    }
  }
}

TEST_F(Simulate, TheTruthReadsBackAsAResultAndSaysWhatItWasMadeFrom) {
  request_.changes["drift_ppm"] = "50";
  request_.seed = 7;
  const Estimate truth = run();
  const Estimate read = estimate_from_json(text("truth.json"), "truth.json");
  EXPECT_EQ(read.offset, truth.offset);
  EXPECT_EQ(read.epoch, truth.epoch);
  EXPECT_NEAR(read.drift.value(), 50e-6, 1e-15);
  EXPECT_TRUE(read.T_reference_sensor->isApprox(*truth.T_reference_sensor));
  EXPECT_EQ(read.provenance.seed, 7u);
  EXPECT_NE(text("truth.json").find("\"drift_ppm\": 50"), std::string::npos);
  EXPECT_NE(text("truth.json").find("\"resolution\": \"160x120\""), std::string::npos);
}

TEST_F(Simulate, AScenarioFileHoldsOnlyWhatDiffersAndTheCommandLineWins) {
  request_.changes = {{"tracks", "true"}, {"duration_s", "0.5"}, {"offset_s", "0.25"}};
  request_.scenario = scenario("# shaken\nmotion: fast\noffset_s: -1.5\nimu_rate_hz: 100\n");
  const Estimate truth = run();
  EXPECT_EQ(truth.offset, from_seconds(0.25));
  EXPECT_NE(text("truth.json").find("\"motion\": \"fast\""), std::string::npos);
  EXPECT_EQ(open_recording(request_.folder).imus.front().size(), 51u);
}

TEST_F(Simulate, AScenarioMayBeTheNameOfAMotion) {
  request_.changes["tracks"] = "true";
  request_.scenario = "single_axis";
  static_cast<void>(run());
  EXPECT_NE(text("truth.json").find("\"motion\": \"single_axis\""), std::string::npos);
}

TEST_F(Simulate, TheProjectsScenariosHaveNamesAndNumbers) {
  request_.changes["resolution"] = "64x48";
  request_.changes["duration_s"] = "1";
  for (const char* name : {"011", "rolling-shutter", "011-rolling-shutter"}) {
    request_.scenario = name;
    request_.folder = (root_ / name).string();
    const Estimate truth = kind("handheld").write(request_);
    EXPECT_GT(truth.line_delay_s.value_or(0), 0) << name;
  }
}

TEST_F(Simulate, EveryScenarioOfTheProjectCanBeMade) {
  int made = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(TAKT_SOURCE_DIR) / "scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    request_.scenario = entry.path().string();
    request_.folder = (root_ / entry.path().stem()).string();
    // 201 and on are clocks; all others move.
    const bool clock = entry.path().stem().string().find("-clock-") != std::string::npos;
    request_.changes = clock ? ParameterChanges{} : ParameterChanges{{"duration_s", "1"}, {"resolution", "64x48"}};
    EXPECT_NO_THROW(static_cast<void>(kind(clock ? "clock" : "handheld").write(request_))) << entry.path();
    ++made;
  }
  EXPECT_GE(made, 18);
}

TEST_F(Simulate, WhatCannotBeSimulatedIsSaidAndLeavesNothingBehind) {
  const auto complaint = [&](ParameterChanges changes) {
    request_.changes = std::move(changes);
    try {
      static_cast<void>(run());
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string("no complaint");
  };
  EXPECT_NE(complaint({{"expsure_s", "1"}}).find("no parameter 'expsure_s'; there are motion"), std::string::npos);
  EXPECT_EQ(complaint({{"offset_s", "1,5"}}), "offset_s: '1,5' is not a number");
  EXPECT_EQ(complaint({{"stamp", "late"}}), "stamp: 'late' is none of start, middle, end");
  EXPECT_EQ(complaint({{"drop", "1.5"}}), "drop: '1.5' does not lie between 0 and 0.99");
  EXPECT_NE(complaint({{"tracks", "true"}, {"stamp", "end"}, {"exposure_swing", "0.2"}}).find("one exposure"),
            std::string::npos);
  EXPECT_EQ(complaint({{"exposure_s", "-0.1"}}), "exposure_s: '-0.1' is negative");
  EXPECT_NE(complaint({{"resolution", "640"}}).find("WIDTHxHEIGHT"), std::string::npos);
  EXPECT_NE(complaint({{"motion", "dance"}}).find("there are handheld"), std::string::npos);
  request_.changes.clear();
  request_.scenario = scenario("motion: [1, 2]\n");
  EXPECT_THROW(run(), Error);
  request_.scenario = scenario("motion: [1, 2\n");
  EXPECT_THROW(run(), Error);
  EXPECT_TRUE(fs::is_empty(root_) || (fs::remove(root_ / "scenario.yaml"), fs::is_empty(root_)));
}

TEST_F(Simulate, NeverWritesOverAFolder) {
  request_.changes["tracks"] = "true";
  static_cast<void>(run());
  EXPECT_THROW(run(), Error);
  EXPECT_FALSE(fs::exists(unfinished(request_.folder)));
}

TEST_F(Simulate, AnUnfinishedFolderVanishes) {
  {
    const NewFolder folder(request_.folder);
    folder.write("a.txt", "a");
    EXPECT_TRUE(fs::exists(unfinished(request_.folder) / "a.txt"));
  }
  EXPECT_TRUE(fs::is_empty(root_));
}

}  // namespace
}  // namespace takt
