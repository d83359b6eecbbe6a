// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pendulum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "takt/recording/files.h"
#include "takt/workflows/dial_rig.h"
#include "takt/workflows/pendulum_repeats.h"
#include "takt/workflows/simulate.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::TemporaryFolder;

/// The second kind is the pendulum.
Estimate simulated(const std::string& folder, const ParameterChanges& changes, std::uint64_t seed) {
  SimulationRequest request;
  request.folder = folder;
  request.changes = changes;
  request.seed = seed;
  for (const SimulationKind& kind : simulation_kinds())
    if (std::string(kind.name) == "pendulum") return kind.write(request);
  throw std::logic_error("there is no pendulum to simulate");
}

double extra(const Estimate& e, const std::string& name) {
  for (const Extra& x : e.extras)
    if (x.name == name) return x.value;
  ADD_FAILURE() << "no extra " << name;
  return 0;
}

TEST(PendulumWorkflow, FromPicturesToTheDelayOfTwoImus) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/run";
  // Twelve seconds at 25 frames/s, so that the test is quick; all other conversions are in it.
  const Estimate truth = simulated(path,
                                   {{"duration_s", "12.5"},
                                    {"frame_rate_hz", "25"},
                                    {"imus", "2"},
                                    {"exposure_s", "0.002"},
                                    {"stamp", "start"},
                                    {"temperature_c", "31"}},
                                   41);
  PendulumJob job;
  job.input = path;
  const PendulumOutcome found = calibrate_pendulum(job);
  ASSERT_EQ(found.estimates.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const Estimate& e = found.estimates[i];
    ASSERT_TRUE(e.answered());
    EXPECT_EQ(e.reference, "imu" + std::to_string(i));
    EXPECT_LT(std::abs(to_seconds(*e.offset - *truth.estimates[i].offset)), 4 * *e.sigma_s);
    EXPECT_LT(*e.sigma_s, 30e-6);
    EXPECT_EQ(e.frame_instant, "middle");
    EXPECT_EQ(extra(e, "temperature_c"), 31);
  }
}

TEST(PendulumWorkflow, RepeatsAreBinnedByTemperature) {
  const TemporaryFolder folder;
  std::vector<PendulumRun> runs;
  std::vector<double> truths;
  const char* const temperatures[] = {"25", "25.4", "40", "39.8", "25.2"};
  for (std::size_t k = 0; k < 5; ++k) {
    const std::string name = "run" + std::to_string(k);
    const Estimate truth = simulated(folder.path() + "/" + name,
                                     {{"duration_s", "20"}, {"angles", "true"}, {"temperature_c", temperatures[k]}}, k);
    truths.push_back(to_seconds(*truth.offset));
    PendulumJob job;
    job.input = folder.path() + "/" + name;
    runs.push_back({name, calibrate_pendulum(job).estimates});
  }
  const Estimate whole = repeat_estimate(runs);
  EXPECT_EQ(whole.estimates.size(), 6u) << "the mean and five runs";
  const double one = 12e-6;  // of a run of 20 s
  EXPECT_NEAR(extra(whole, "mean_at_25.2_c_s"), (truths[0] + truths[1] + truths[4]) / 3, 4 * one / std::sqrt(3.0));
  EXPECT_NEAR(extra(whole, "mean_at_39.9_c_s"), (truths[2] + truths[3]) / 2, 4 * one / std::sqrt(2.0));
  EXPECT_GT(truths[2] - truths[0], 90e-6);
  ASSERT_FALSE(whole.reasons.empty());
  EXPECT_NE(whole.reasons.back().find("the delay changes by"), std::string::npos);
  EXPECT_GT(*whole.sigma_s, 40e-6) << "no one number holds for all temperatures";
  // The file is a result that can be read back, with the temperatures beside it.
  const std::string json = repeat_json(whole, runs);
  EXPECT_EQ(estimate_from_json(json, "test").offset, whole.offset);
  EXPECT_NE(json.find("\"repeatability\""), std::string::npos);
  EXPECT_NE(json.find("\"temperatures\""), std::string::npos);
  EXPECT_NE(repeat_words(runs).find("°C"), std::string::npos);
}

TEST(PendulumWorkflow, ARigFileSaysWhatTheStampsMean) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/run";
  const Estimate truth =
      simulated(path, {{"duration_s", "20"}, {"angles", "true"}, {"exposure_s", "0.01"}, {"stamp", "end"}}, 5);
  PendulumJob job;
  job.angle_file = path + "/angle.csv";
  job.imu_file = path + "/mav0/imu0/data.csv";
  job.rig_file = folder.file("rig.yaml", "exposure_s: 0.01\nstamp: end\ntemperature_c: 33\n");
  const Estimate e = calibrate_pendulum(job).estimates.front();
  ASSERT_TRUE(e.answered());
  EXPECT_LT(std::abs(to_seconds(*e.offset - *truth.offset)), 4 * *e.sigma_s);
  EXPECT_EQ(extra(e, "temperature_c"), 33);
  job.rig_file = folder.file("other.yaml", "exposure_s: 0.01\nstamp: begin\n");
  EXPECT_NEAR(to_seconds(*calibrate_pendulum(job).estimates.front().offset), to_seconds(*e.offset) - 0.01, 1e-7);
  // An exposure that is needed and not told is no trusted answer.
  job.rig_file = folder.file("less.yaml", "stamp: end\n");
  EXPECT_EQ(calibrate_pendulum(job).estimates.front().verdict, Verdict::weak);
  job.rig_file = folder.file("wrong.yaml", "stamp: sideways\n");
  EXPECT_NE(complaint([&] { static_cast<void>(calibrate_pendulum(job)); }), "");
}

TEST(PendulumWorkflow, ARigFileOfAnImpossibleDialIsRefusedWithItsName) {
  const TemporaryFolder folder;
  CameraStream camera;
  camera.model = CameraModel::from_horizontal_fov(640, 480, 1.2);
  const auto why = [&](const std::string& text) {
    const YamlFields rig(text, "rig.yaml");
    return complaint([&] { static_cast<void>(dial_rig(rig, camera, "")); });
  };
  EXPECT_NE(why("dial_radius_m: 750\ncamera_distance_m: 450\n").find("millimetres"), std::string::npos);
  EXPECT_NE(why("dial_radius_m: 0.75\ncamera_distance_m: 0.45\ncell_deg: 0\n").find("rig.yaml"), std::string::npos);
  EXPECT_NE(why("dial_radius_m: 0.75\n").find("camera_distance_m is missing"), std::string::npos);
  EXPECT_EQ(why("dial_radius_m: 0.75\ncamera_distance_m: 0.45\n"), "");
}

TEST(PendulumWorkflow, AnImuThatCannotBeReadIsRefusedBesideTheOthersAnswers) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/run";
  (void)simulated(path, {{"duration_s", "15"}, {"imus", "5"}, {"angles", "true"}}, 43);
  const std::string good = read_file(path + "/mav0/imu0/data.csv");
  (void)folder.file("run/mav0/imu0/data.csv", "");
  std::filesystem::remove(path + "/mav0/imu1/data.csv");
  std::string not_a_number = good;
  not_a_number.replace(not_a_number.find(',', good.size() / 2) + 1, 3, "nan");
  (void)folder.file("run/mav0/imu3/data.csv", not_a_number);
  PendulumJob job;
  job.input = path;
  const PendulumOutcome found = calibrate_pendulum(job);
  ASSERT_EQ(found.estimates.size(), 5u);
  const std::vector<std::string> order{"imu2", "imu4", "imu0", "imu1", "imu3"},
      why{"", "", "is empty", "cannot be read", "not a finite number"};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Estimate& e = found.estimates[i];
    EXPECT_EQ(e.reference, order[i]);
    EXPECT_EQ(e.answered(), i < 2) << order[i];
    if (!e.answered()) {
      EXPECT_NE(e.reasons.at(0).find(why[i]), std::string::npos) << e.reasons[0];
    }
  }
  job.reference = "imu3";
  EXPECT_NE(complaint([&] { (void)calibrate_pendulum(job); }).find("imu3/data.csv"), std::string::npos);
}

TEST(PendulumWorkflow, RatesOfAnAslFolderInDegreesAreReadWhenToldSo) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/run";
  const Estimate truth = simulated(path, {{"duration_s", "15"}, {"angles", "true"}, {"rest_reading_deg", "1"}}, 44);
  PendulumJob job;
  job.input = path;
  job.open.rate_unit = RateUnit::deg_s;
  EXPECT_EQ(calibrate_pendulum(job).estimates.at(0).verdict, Verdict::refused);
  job.open.rate_unit = RateUnit::rad_s;
  const Estimate e = calibrate_pendulum(job).estimates.at(0);
  ASSERT_TRUE(e.answered());
  EXPECT_LT(std::abs(to_seconds(*e.offset - *truth.offset)), 4 * *e.sigma_s);
  job.open.time_unit = TimeUnit::us;
  EXPECT_NE(complaint([&] { (void)calibrate_pendulum(job); }).find("are nanoseconds"), std::string::npos);
}

TEST(PendulumWorkflow, ARollToldTheWrongWayRoundIsTurned) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/run";
  const Estimate truth = simulated(path, {{"duration_s", "8"}, {"frame_rate_hz", "20"}, {"roll_deg", "25"}}, 7);
  std::string rig = read_file(path + "/rig.yaml");
  rig.replace(rig.find("roll_deg: 25"), 12, "roll_deg: -25");
  std::ofstream(path + "/rig.yaml") << rig;
  PendulumJob job;
  job.input = path;
  const PendulumOutcome found = calibrate_pendulum(job);
  ASSERT_TRUE(found.estimates.front().answered());
  EXPECT_LT(std::abs(to_seconds(*found.estimates.front().offset - *truth.offset)),
            4 * *found.estimates.front().sigma_s);
  EXPECT_NE(found.notes.back().find("the other sign of roll_deg"), std::string::npos) << found.notes.back();
}

TEST(PendulumWorkflow, PicturesOfAnotherSizeThanTheCamerasAreRefused) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/run";
  static_cast<void>(simulated(path, {{"duration_s", "1"}}, 6));
  const std::string sensor = path + "/mav0/cam0/sensor.yaml";
  std::string text = read_file(sensor);
  text.replace(text.find("[640, 480]"), 10, "[320, 240]");
  std::ofstream(sensor) << text;
  PendulumJob job;
  job.input = path;
  EXPECT_NE(complaint([&] { static_cast<void>(calibrate_pendulum(job)); }).find("640x480"), std::string::npos);
}

}  // namespace
}  // namespace takt
