// SPDX-License-Identifier: Apache-2.0
// takt export as it is typed: for each tool the status, the sentence, and a file that other readers take.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/output.h"
#include "takt/recording/kalibr_files.h"
#include "takt/workflows/export.h"
#include "tests/tools.h"

namespace takt::cli {
namespace {

using testing_tools::TemporaryFolder;

std::string content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Ran {
  int status;
  std::string out, err;
};
Ran takt_command(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string out = folder.path() + "/out.log", err = folder.path() + "/err.log";
  const int status = std::system((std::string(TAKT_COMMAND) + " " + arguments + " >" + out + " 2>" + err).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content(out), content(err)};
}

/// The truth of a simulated recording, and the camera file beside it.
struct Simulated {
  TemporaryFolder folder;
  std::string truth = folder.path() + "/hh/truth.json", camera = folder.path() + "/hh/mav0/cam0/sensor.yaml";
  Simulated() {
    const Ran made = takt_command(folder, "simulate handheld --duration 1 -q -o " + folder.path() + "/hh");
    EXPECT_EQ(made.status, 0) << made.err;
  }
};

/// Made once: the tests only read it, each into files of its own.
const Simulated& simulated() {
  static const Simulated made;
  return made;
}

TEST(Export, EveryToolGetsAFileAndASentence) {
  const Simulated& made = simulated();
  for (const std::string& tool : export_names()) {
    const std::string file = made.folder.path() + "/" + tool;
    const std::string call = "export " + made.truth + " --as " + tool + " --intrinsics " + made.camera;
    const Ran told = takt_command(made.folder, call + " -o " + file);
    EXPECT_EQ(told.status, 0) << tool << ": " << told.err;
    EXPECT_NE(told.out.find("cam0 is 12.3 ms early against imu0"), std::string::npos) << tool << ": " << told.out;
    const Ran json = takt_command(made.folder, call + " --json");
    EXPECT_EQ(json.status, 0) << tool;
    const auto object = nlohmann::json::parse(json.out);
    EXPECT_EQ(object["as"], tool);
    EXPECT_EQ(object["text"], content(file)) << tool;
    const bool has_value = content(file).find("0.012300000") != std::string::npos ||
                           content(file).find("12300000") != std::string::npos ||
                           content(file).find("12.300000") != std::string::npos;
    EXPECT_TRUE(has_value) << tool << ": " << content(file);
  }
}

TEST(Export, KalibrsFileIsReadBack) {
  const Simulated& made = simulated();
  const std::string file = made.folder.path() + "/camchain.yaml";
  ASSERT_EQ(
      takt_command(made.folder, "export " + made.truth + " --as kalibr -o " + file + " --intrinsics " + made.camera)
          .status,
      0);
  const KalibrCamchain chain = read_kalibr_camchain_file(file);
  ASSERT_EQ(chain.size(), 1u);
  EXPECT_EQ(chain[0].timeshift_cam_imu_s, 0.0123);
  EXPECT_EQ(chain[0].model.width, 640);
}

TEST(Export, OneSensorOfSeveralIsChosenAndTheOthersAreNamed) {
  const TemporaryFolder folder;
  const auto of = [](const char* sensor, std::int64_t ns) {
    Estimate e;
    e.method = "spline";
    e.verdict = Verdict::trusted;
    e.sensor = sensor;
    e.reference = "imu0";
    e.offset = Duration(ns);
    return e;
  };
  Estimate all = of("cam0", 1'000'000);
  all.estimates = {of("cam0", 1'000'000), of("cam1", 2'000'000), of("imu1", 3'000'000)};
  const std::string result = folder.path() + "/r.json",
                    chain = folder.file(
                        "chain.yaml",
                        "cam0: {camera_model: pinhole, intrinsics: [400, 400, 320, 240], resolution: [640, 480]}\n"
                        "cam1: {camera_model: pinhole, intrinsics: [500, 500, 320, 240], resolution: [640, 480]}\n");
  write_result(all, result);
  const Ran first = takt_command(folder, "export " + result + " --as kalibr");
  EXPECT_NE(first.out.find("timeshift_cam_imu: 0.001000000"), std::string::npos) << first.out;
  EXPECT_NE(first.err.find("of cam0 only, not cam1 against imu0:"), std::string::npos) << first.err;
  const Ran second = takt_command(folder, "export " + result + " --as kalibr --sensor cam1 --intrinsics " + chain);
  EXPECT_NE(second.out.find("timeshift_cam_imu: 0.002000000"), std::string::npos) << second.out;
  EXPECT_NE(second.out.find("[500.0, 500.0"), std::string::npos) << second.out;
  const Ran imu = takt_command(folder, "export " + result + " --as kalibr --sensor imu1");
  EXPECT_EQ(imu.status, 1);
  EXPECT_NE(imu.err.find("is an IMU as imu0 is"), std::string::npos) << imu.err;
  EXPECT_NE(takt_command(folder, "export " + result + " --as kalibr --sensor cam7").err.find("it has: cam0"),
            std::string::npos);
}

TEST(Export, WhatCannotBeWrittenIsSaid) {
  const Simulated& made = simulated();
  const std::string fov =
      made.folder.file("fov.yaml",
                       "camera_model: pinhole\nintrinsics: [400, 400, 320, 240]\ndistortion_model: fov\n"
                       "distortion_coefficients: [0.9]\nresolution: [640, 480]\n");
  const std::string file = made.folder.path() + "/ov.yaml";
  const Ran lens =
      takt_command(made.folder, "export " + made.truth + " --as openvins -o " + file + " --intrinsics " + fov);
  EXPECT_EQ(lens.status, 1);
  EXPECT_NE(lens.err.find("not pinhole-fov"), std::string::npos) << lens.err;
  EXPECT_EQ(content(file), "");
  EXPECT_EQ(takt_command(made.folder, "export " + made.truth + " --as excel").status, 2);
  const std::string refused = made.folder.path() + "/refused.json";
  write_result(Estimate::refusal("ml", "no motion"), refused);
  const Ran none = takt_command(made.folder, "export " + refused + " --as vins");
  EXPECT_EQ(none.status, 3);
  EXPECT_NE(none.err.find("nothing to export"), std::string::npos) << none.err;
}

}  // namespace
}  // namespace takt::cli
