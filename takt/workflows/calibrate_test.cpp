// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/calibrate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "takt/calibration/tree.h"
#include "takt/calibration/words.h"
#include "takt/error.h"
#include "takt/recording/kalibr_files.h"
#include "takt/workflows/calibrate_cameras.h"
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

TEST_F(Calibrate, NoiseFiguresThatAreWrongAreNamedAndDoNoHarm) {
  const KalibrImu right = read_kalibr_imus_file(folder() + "/imu.yaml").at(0);
  for (const double factor : {10.0, 0.1}) {
    KalibrImu wrong = right;
    wrong.noise.gyro_density *= factor;
    wrong.noise.accel_density *= factor;
    CalibrateJob j = job();
    j.imu = (root() / "wrong.yaml").string();
    std::ofstream(j.imu) << write_kalibr_imus({wrong});
    const Estimate e = calibrate(j).estimate;
    EXPECT_EQ(e.offset, calibrated().estimate.offset);
    EXPECT_EQ(e.sigma_s, calibrated().estimate.sigma_s);
    for (const std::string what : {"gyro", "accelerometer"})
      EXPECT_TRUE(std::ranges::any_of(e.reasons,
                                      [&](const std::string& why) {
                                        return why.find("noise of imu0's " + what) != std::string::npos &&
                                               why.find("wrong.yaml") != std::string::npos;
                                      }))
          << what << " " << factor;
  }
  for (const std::string& why : calibrated().estimate.reasons) EXPECT_EQ(why.find("the noise of"), std::string::npos);
}

TEST_F(Calibrate, AMissingTargetIsOneClearLine) {
  CalibrateJob j = job();
  j.target = folder() + "/none.yaml";
  EXPECT_THROW((void)calibrate(j), Error);
  j = job();
  j.sensor = "cam7";
  EXPECT_THROW((void)calibrate(j), Error);
}

TEST_F(Calibrate, CamerasAloneFindTheLensThatFilmedThem) {
  CamerasJob j;
  j.input = folder();
  j.target = folder() + "/target.yaml";
  const CalibratedCameras found = calibrate_cameras(j);
  ASSERT_EQ(found.cameras.size(), 1u);
  const batch::CalibratedCamera& camera = found.cameras[0].found;
  ASSERT_NE(camera.verdict, Verdict::refused) << (found.reasons.empty() ? "" : found.reasons.front());
  const CameraModel truth = read_kalibr_camchain_file(folder() + "/camchain.yaml").at(0).model;
  EXPECT_EQ(camera.model.width, truth.width);
  // In pixels, not in σ: a rendered film is so clean (0.006 px) that the detector's own bias of a few thousandths is
  // above the noise of the mean (docs/methods/intrinsics.md). Five seconds do not reach the picture's own corners.
  for (double v = 0.1 * truth.height; v < 0.9 * truth.height; v += 24)
    for (double u = 0.1 * truth.width; u < 0.9 * truth.width; u += 24) {
      const auto is = truth.bearing({u, v});
      ASSERT_TRUE(is);
      const auto at = camera.model.project(*is);
      ASSERT_TRUE(at);
      EXPECT_LT((*at - Vec2(u, v)).norm(), 0.02) << u << " " << v;
    }

  for (const bool opencv : {false, true}) {
    const KalibrCamchain chain = read_kalibr_camchain(kalibr_camera_files(found, opencv).camchain, "camchain");
    ASSERT_EQ(chain.size(), 1u);
    EXPECT_LT((intrinsics_of(chain[0].model) - intrinsics_of(camera.model)).norm(), 1e-9);
  }
  const tree::Node document = tree::from_json(to_json(found), "result");
  EXPECT_EQ(document.find("schema")->scalar, "takt/1-cameras");
  const tree::Node& fx = *document.find("cameras")->children.at(0).node.find("intrinsics")->find("fx");
  EXPECT_EQ(std::stod(fx.find("value")->scalar), camera.model.fx);

  const std::string page = report_page(found);
  EXPECT_NE(page.find(value_words(camera.model.fx, camera.sigma[0])), std::string::npos);
  for (const char* panel : {"reprojection_scatter", "radial_residuals", "coverage"})
    EXPECT_NE(page.find(std::string("data-panel=\"cam0_") + panel), std::string::npos) << panel;
}

TEST_F(Calibrate, CamerasAloneSayWhatTheyCannot) {
  CamerasJob j;
  j.input = folder();
  j.target = folder() + "/target.yaml";
  j.lenses = {"pinhole-radtan", "ds-none"};
  EXPECT_THROW((void)calibrate_cameras(j), Error);  // two lenses, one camera
  j.lenses = {"fisheye"};
  EXPECT_THROW((void)calibrate_cameras(j), Error);

  // Another board than the one that was filmed: no answer, and valid JSON that says so.
  j.lenses = {};
  j.open.to_s = 0.5;
  j.target = (root() / "other.yaml").string();
  std::ofstream(j.target) << "target_type: checkerboard\ntargetCols: 7\ntargetRows: 5\n"
                             "rowSpacingMeters: 0.03\ncolSpacingMeters: 0.03\n";
  const CalibratedCameras none = calibrate_cameras(j);
  EXPECT_EQ(none.verdict, Verdict::refused);
  ASSERT_FALSE(none.reasons.empty());
  EXPECT_EQ(tree::from_json(to_json(none), "result").find("verdict")->scalar, "refused");
  EXPECT_NE(report_page(none).find(none.reasons.front().substr(0, 20)), std::string::npos);
}

/// OpenCV's stereo pairs as folders of pictures without any IMU. What OpenCV finds in them: docs/methods/intrinsics.md.
TEST_F(Calibrate, CamerasAloneOnOpenCvsChessboards) {
  const fs::path from = "/usr/share/doc/opencv-doc/examples/data";
  if (!fs::exists(from / "left01.jpg")) GTEST_SKIP() << "no opencv-doc here";
  const fs::path rig = root() / "stereo";
  for (const auto& [camera, side] : {std::pair{"cam0", "left"}, {"cam1", "right"}}) {
    fs::create_directories(rig / camera);
    for (int k = 1; k <= 14; ++k) {
      const std::string number = (k < 10 ? "0" : "") + std::to_string(k);
      const fs::path picture = from / (side + number + ".jpg");
      if (fs::exists(picture))
        fs::copy_file(picture, rig / camera / ("14000000" + number + "000000000.jpg"),
                      fs::copy_options::overwrite_existing);
    }
  }
  CamerasJob j;
  j.input = rig.string();
  j.target = (rig / "board.yaml").string();
  std::ofstream(j.target) << "target_type: checkerboard\ntargetCols: 9\ntargetRows: 6\n"
                             "rowSpacingMeters: 0.025\ncolSpacingMeters: 0.025\n";
  const CalibratedCameras found = calibrate_cameras(j);
  EXPECT_EQ(found.verdict, Verdict::trusted) << (found.reasons.empty() ? "" : found.reasons.front());
  ASSERT_EQ(found.cameras.size(), 2u);
  constexpr double opencv_fx[2]{533.09, 537.20}, opencv_sigma[2]{0.61, 0.70};
  for (std::size_t c = 0; c < 2; ++c) {
    const batch::CalibratedCamera& camera = found.cameras[c].found;
    EXPECT_LT(std::abs(camera.model.fx - opencv_fx[c]), 4 * std::hypot(opencv_sigma[c], camera.sigma[0]));
    EXPECT_LT(camera.rms_px, 0.14);
  }
  // OpenCV's stereo sample, in squares: the baseline is 3.33 of them.
  ASSERT_TRUE(found.cameras[1].to_before);
  EXPECT_NEAR(found.cameras[1].to_before->T_cn_cnm1.translation.norm() / 0.025, 3.33, 0.03);
  EXPECT_EQ(found.cameras[1].overlaps, std::vector<int>{0});
}

}  // namespace
}  // namespace takt
