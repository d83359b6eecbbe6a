// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/calibrate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "takt/error.h"
#include "takt/recording/kalibr_files.h"
#include "takt/workflows/simulate.h"

namespace fs = std::filesystem;

namespace takt {
namespace {

/// Five seconds of pictures before a board, made once.
class Calibrate : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    fs::remove_all(root());
    fs::create_directories(root());
    for (const SimulationKind& kind : simulation_kinds()) {
      if (std::string(kind.name) != "target") continue;
      SimulationRequest request;
      request.folder = folder();
      request.seed = 4;
      request.changes = {{"duration_s", "5"}, {"frame_rate_hz", "10"}};
      truth() = kind.write(request);
    }
  }
  static void TearDownTestSuite() { fs::remove_all(root()); }

  static fs::path root() { return fs::path(testing::TempDir()) / "takt_calibrate_test"; }
  static std::string folder() { return (root() / "made").string(); }
  static Estimate& truth() {
    static Estimate e;
    return e;
  }
  static CalibrateJob job() {
    CalibrateJob j;
    j.input = folder();
    j.target = folder() + "/target.yaml";
    j.camchain = folder() + "/camchain.yaml";
    j.imu = folder() + "/imu.yaml";
    return j;
  }
  static const Calibrated& calibrated() {
    static const Calibrated c = calibrate(job());
    return c;
  }
};

TEST_F(Calibrate, FromPicturesToTheOffset) {
  const Estimate& e = calibrated().estimate;
  ASSERT_TRUE(e.answered()) << (e.reasons.empty() ? "" : e.reasons.front());
  const double error = to_seconds(*e.offset - *truth().offset);
  EXPECT_LT(std::abs(error), 4 * *e.sigma_s);
  EXPECT_LT(*e.sigma_s, 5e-5);
  EXPECT_FALSE(calibrated().files.empty());
}

TEST_F(Calibrate, KalibrsFilesSayTheSame) {
  const Estimate& e = calibrated().estimate;
  for (const bool opencv : {false, true}) {
    const KalibrFiles files = kalibr_files(calibrated(), opencv);
    const KalibrCamchain chain = read_kalibr_camchain(files.camchain, "camchain");
    ASSERT_EQ(chain.size(), 1u);
    EXPECT_NEAR(*chain[0].timeshift_cam_imu_s, to_seconds(*e.offset), 1e-9);
    EXPECT_LT((*chain[0].T_cam_imu * *e.T_reference_sensor - Mat4::Identity()).norm(), 1e-9);
    EXPECT_EQ(read_kalibr_imus(files.imu, "imu").size(), 1u);
  }
}

TEST_F(Calibrate, AMissingTargetIsOneClearLine) {
  CalibrateJob j = job();
  j.target = folder() + "/none.yaml";
  EXPECT_THROW((void)calibrate(j), Error);
  j = job();
  j.sensor = "cam7";
  EXPECT_THROW((void)calibrate(j), Error);
}

}  // namespace
}  // namespace takt
