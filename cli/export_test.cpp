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
