// SPDX-License-Identifier: Apache-2.0
// Every export is read back by a reader that is not ours, and applied as the tool would apply it.
#include "takt/apply/exports.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "takt/error.h"

namespace takt {
namespace {

constexpr double shift_s = -0.012345678;

Mat4 mounting() {
  Mat4 t = Mat4::Identity();
  t.topLeftCorner<3, 3>() = Eigen::AngleAxisd(1.2, Vec3(1, -2, 3).normalized()).toRotationMatrix();
  t.topRightCorner<3, 1>() = Vec3(0.05, -0.02, 0.01);
  return t;
}
Estimate answer() {
  Estimate e;
  e.verdict = Verdict::trusted;
  e.sensor = "cam0";
  e.reference = "imu0";
  e.offset = from_seconds(shift_s);
  e.sigma_s = 1e-5;
  e.epoch = from_ns(1'403'715'273'262'142'976);
  e.T_reference_sensor = mounting();
  return e;
}
CameraModel camera() {
  CameraModel m;
  m.width = 752, m.height = 480, m.fx = 458.654, m.fy = 457.296, m.cx = 367.215, m.cy = 248.375;
  m.distortion = Distortion::radtan;
  m.coeffs = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  return m;
}
std::string exported(const std::string& name, const Estimate& e = answer()) {
  return export_format(name)->write(camera_to_imu(e, camera())).text;
}
YAML::Node yaml(std::string text) {
  if (text.starts_with("%YAML:1.0")) text.insert(0, "#");  // as those do who load OpenCV's files with another reader
  return YAML::Load(text);
}
cv::FileStorage opencv(const std::string& text) {
  return {text, cv::FileStorage::READ | cv::FileStorage::MEMORY};
}
Mat4 matrix(const cv::Mat& m) {
  Mat4 out;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) out(r, c) = m.at<double>(r, c);
  return out;
}
Mat4 matrix(const YAML::Node& rows) {
  Mat4 out;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) out(r, c) = rows[r][c].as<double>();
  return out;
}

TEST(Exports, KalibrAddsItToTheCamera) {
  const YAML::Node cam = yaml(exported("kalibr"))["cam0"];
  EXPECT_EQ(cam["timeshift_cam_imu"].as<double>(), shift_s);
  EXPECT_LT((matrix(cam["T_cam_imu"]) * mounting() - Mat4::Identity()).norm(), 1e-14);
  EXPECT_EQ(cam["intrinsics"][1].as<double>(), 457.296);
  EXPECT_EQ(cam["distortion_coeffs"][3].as<double>(), 1.76187114e-05);
  EXPECT_EQ(cam["resolution"][1].as<int>(), 480);
}

TEST(Exports, KalibrGetsEveryModelWithItsNumbersInItsOrder) {
  CameraModel m = camera();
  m.coeffs = {1e-5, -2e-6, 0, 3e-7};
  m.shape = {1.25, 0};
  m.projection = Projection::omni;
  const std::string text = export_kalibr(camera_to_imu(answer(), m)).text;
  const YAML::Node omni = yaml(text)["cam0"];
  EXPECT_EQ(omni["camera_model"].as<std::string>(), "omni");
  EXPECT_EQ(omni["intrinsics"].as<std::vector<double>>(),
            (std::vector<double>{1.25, 458.654, 457.296, 367.215, 248.375}));
  EXPECT_EQ(omni["distortion_coeffs"].as<std::vector<double>>(), (std::vector<double>{1e-5, -2e-6, 0, 3e-7}));
  EXPECT_NE(text.find("[1.0e-05, -2.0e-06, 0.0, 3.0e-07]"), std::string::npos) << text;  // PyYAML: 1e-05 is a word

  m.projection = Projection::double_sphere;
  m.shape = {-0.2, 0.6};
  m.distortion = Distortion::none;
  const YAML::Node ds = yaml(export_kalibr(camera_to_imu(answer(), m)).text)["cam0"];
  EXPECT_EQ(ds["camera_model"].as<std::string>(), "ds");
  EXPECT_EQ(ds["intrinsics"].size(), 6u);
  EXPECT_EQ(ds["intrinsics"][1].as<double>(), 0.6);
  EXPECT_EQ(ds["distortion_model"].as<std::string>(), "none");
  EXPECT_EQ(ds["distortion_coeffs"].size(), 0u);

  m.projection = Projection::pinhole;
  m.distortion = Distortion::fov;
  m.coeffs = {0.9};
  const YAML::Node fov = yaml(export_kalibr(camera_to_imu(answer(), m)).text)["cam0"];
  EXPECT_EQ(fov["distortion_model"].as<std::string>(), "fov");
  EXPECT_EQ(fov["distortion_coeffs"].as<std::vector<double>>(), std::vector<double>{0.9});
}

TEST(Exports, OpenVinsRefusesLensesThatItWouldTakeForOthers) {
  CameraModel m = camera();
  m.distortion = Distortion::none;
  m.coeffs = {};
  const YAML::Node plain = yaml(export_openvins(camera_to_imu(answer(), m)).text)["cam0"];
  EXPECT_EQ(plain["distortion_model"].as<std::string>(), "radtan");
  EXPECT_EQ(plain["distortion_coeffs"].as<std::vector<double>>(), std::vector<double>(4, 0.0));
  m.projection = Projection::eucm;
  EXPECT_THROW((void)export_openvins(camera_to_imu(answer(), m)), Error);
  m.projection = Projection::pinhole;
  m.distortion = Distortion::fov;
  EXPECT_THROW((void)export_openvins(camera_to_imu(answer(), m)), Error);
}

TEST(Exports, OpenVinsIsReadByOpencvAndByYaml) {
  const std::string text = exported("openvins");
  const cv::FileStorage file = opencv(text);
  ASSERT_TRUE(file.isOpened());
  EXPECT_EQ(static_cast<double>(file["calib_cam_timeoffset"]), shift_s);
  EXPECT_EQ(static_cast<double>(file["cam0"]["timeshift_cam_imu"]), shift_s);
  const cv::FileNode rows = file["cam0"]["T_imu_cam"];
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(static_cast<double>(rows[0][3]), 0.05);
  EXPECT_EQ(static_cast<double>(file["cam0"]["intrinsics"][0]), 458.654);
  EXPECT_EQ(matrix(yaml(text)["cam0"]["T_imu_cam"]), mounting());
}

TEST(Exports, VinsHasTdTheMountingAndTheReadout) {
  Estimate e = answer();
  e.line_delay_s = 20e-6;
  e.frame_row = "first";
  const cv::FileStorage file = opencv(exported("vins", e));
  cv::Mat body_T_cam0;
  file["body_T_cam0"] >> body_T_cam0;
  EXPECT_EQ(matrix(body_T_cam0), mounting());
  EXPECT_DOUBLE_EQ(static_cast<double>(file["rolling_shutter_tr"]), 20e-6 * 480);
  // Row v is seen at t + td + tr·(v/480 − 1/2); the first row then at the first row's own offset.
  const double td = static_cast<double>(file["td"]), tr = static_cast<double>(file["rolling_shutter_tr"]);
  EXPECT_NEAR(td + tr * (0.0 - 0.5), shift_s, 1e-9);
}

TEST(Exports, VinsMonoHasTheMountingInTwoParts) {
  const cv::FileStorage file = opencv(exported("vins"));
  cv::Mat R, t;
  file["extrinsicRotation"] >> R;
  file["extrinsicTranslation"] >> t;
  ASSERT_EQ(R.rows, 3);
  ASSERT_EQ(t.cols, 1);
  EXPECT_EQ(R.at<double>(0, 2), mounting()(0, 2));
  EXPECT_EQ(t.at<double>(1), -0.02);
}

TEST(Exports, BasaltIsJsonInNanoseconds) {
  const auto json = nlohmann::json::parse(exported("basalt"))["value0"];
  EXPECT_EQ(json["cam_time_offset_ns"].get<std::int64_t>(), -12'345'678);
  const auto& pose = json["T_imu_cam"][0];
  const Eigen::Quaterniond q(pose["qw"], pose["qx"], pose["qy"], pose["qz"]);
  EXPECT_LT((q.toRotationMatrix() - mounting().topLeftCorner<3, 3>()).norm(), 1e-14);
  EXPECT_EQ(pose["pz"].get<double>(), 0.01);
}

TEST(Exports, OrbSlam3GetsTheMountingAndAnAdvice) {
  const Exported out = export_orbslam3(camera_to_imu(answer(), camera()));
  const cv::FileStorage file = opencv(out.text);
  cv::Mat m;
  file["IMU.T_b_c1"] >> m;
  ASSERT_EQ(m.type(), CV_32F);  // ORB-SLAM3 reads with at<float>, whatever is there
  m.convertTo(m, CV_64F);
  EXPECT_LT((matrix(m) - mounting()).norm(), 1e-6);
  EXPECT_NE(out.sentence.find("takt apply"), std::string::npos);
}

TEST(Exports, KimeraOkvisFastlivoAndIkalibrHaveTheirOwnSigns) {
  const std::int64_t frame_ns = 1'000'000'000'000;
  const auto want_ns = static_cast<double>(frame_ns) + 1e9 * shift_s;
  const auto moved = [&](double added_s) { return static_cast<double>(frame_ns) + 1e9 * added_s; };
  const cv::FileStorage kimera = opencv(exported("kimera")), okvis = opencv(exported("okvis"));
  EXPECT_NEAR(moved(static_cast<double>(kimera["imu_time_shift"])), want_ns, 0.5);
  EXPECT_EQ(static_cast<double>(kimera["T_BS"]["data"][3]), 0.05);
  EXPECT_NEAR(moved(-static_cast<double>(okvis["camera_parameters"]["image_delay"])), want_ns, 0.5);
  EXPECT_EQ(static_cast<double>(okvis["imageDelay"]), static_cast<double>(okvis["camera_parameters"]["image_delay"]));
  EXPECT_EQ(static_cast<double>(okvis["cameras"][0]["T_SC"][7]), -0.02);
  const YAML::Node livo = yaml(exported("fastlivo2"))["time_offset"];
  // The image's stamps get their offset added, the IMU's have theirs taken off.
  EXPECT_NEAR(moved(livo["img_time_offset"].as<double>() + livo["imu_time_offset"].as<double>()), want_ns, 0.5);
  const YAML::Node ikalibr = yaml(exported("ikalibr"))["CalibParam"]["TEMPORAL"]["TO_CmToBr"][0];
  EXPECT_EQ(ikalibr["key"].as<std::string>(), "cam0");
  EXPECT_NEAR(moved(ikalibr["value"].as<double>()), want_ns, 0.5);
}

TEST(Exports, GyroflowHasTheOppositeSignAndFollowsTheDrift) {
  Estimate e = answer();
  e.epoch = from_ns(5'000'000'000);
  e.drift = 20e-6;
  e.line_delay_s = 10e-6;
  e.frame_row = "middle";
  const auto json = nlohmann::json::parse(exported("gyroflow", e));
  EXPECT_NEAR(json["offsets"]["5000000"].get<double>(), -1e3 * shift_s, 1e-6);
  EXPECT_NEAR(json["offsets"]["65000000"].get<double>(), -1e3 * (shift_s + 60 * 20e-6), 1e-6);
  EXPECT_DOUBLE_EQ(json["stabilization"]["frame_readout_time"].get<double>(), 4.8);
}

TEST(Exports, GyroflowsMillisecondsAreExact) {
  Estimate e = answer();
  e.offset = Duration(12'300'000);
  EXPECT_NE(exported("gyroflow", e).find(": -12.300000\n"), std::string::npos) << exported("gyroflow", e);
}

TEST(Exports, AMountingWithoutTranslationIsNotPassedOnInSilence) {
  Estimate e = answer();
  e.T_reference_sensor->topRightCorner<3, 1>().setZero();
  const CameraToImu c = camera_to_imu(e, camera());
  ASSERT_EQ(c.remarks.size(), 1u);
  EXPECT_NE(c.remarks[0].find("no translation"), std::string::npos);
  for (const char* name : {"kalibr", "openvins", "vins", "orbslam3", "kimera", "okvis"}) {
    const std::string text = exported(name, e);
    EXPECT_NE(text.find("# the translation of the mounting was not found"), std::string::npos) << name;
    EXPECT_NO_THROW((void)yaml(text)) << name;
    if (text.starts_with("%YAML")) {
      EXPECT_TRUE(opencv(text).isOpened()) << name;
    }
    EXPECT_EQ(exported(name).find("not found"), std::string::npos) << name;
  }
  const cv::FileStorage vins = opencv(exported("openvins", e));
  EXPECT_EQ(static_cast<double>(vins["cam0"]["T_imu_cam"][3][3]), 1);
  EXPECT_EQ(static_cast<double>(vins["cam0"]["timeshift_cam_imu"]), shift_s);
}

TEST(Exports, AResultWithTheImuAsSensorIsTurnedRound) {
  Estimate e = answer();
  std::swap(e.sensor, e.reference);
  const CameraToImu c = camera_to_imu(e, camera());
  EXPECT_EQ(c.camera, "cam0");
  EXPECT_EQ(c.shift_ns, 12'345'678);
  EXPECT_LT((*c.T_imu_cam * mounting() - Mat4::Identity()).norm(), 1e-14);
}

TEST(Exports, TwoImusAreNoCameraAndAnImu) {
  Estimate e = answer();
  e.sensor = "imu1";
  EXPECT_THROW((void)camera_to_imu(e, std::nullopt), Error);
  e.sensor = "/camera/imu";  // in a camera's housing
  EXPECT_THROW((void)camera_to_imu(e, std::nullopt), Error);
  e.reference = "/camera/color/image_raw";
  EXPECT_EQ(camera_to_imu(e, std::nullopt).camera, e.reference);
  EXPECT_EQ(camera_to_imu(e, std::nullopt).shift_ns, -e.offset->count());
}

TEST(Exports, AnotherInstantThanTheMiddleIsSaid) {
  Estimate e = answer();
  e.frame_instant = "start";
  const CameraToImu c = camera_to_imu(e, camera());
  ASSERT_EQ(c.remarks.size(), 1u);
  EXPECT_NE(c.remarks[0].find("half the exposure has to be added"), std::string::npos);
  e.frame_instant = "middle";
  EXPECT_TRUE(camera_to_imu(e, camera()).remarks.empty());
}

TEST(Exports, ADriftThatMayBeNoneIsNotSpokenOf) {
  Estimate e = answer();
  e.drift = 1e-6;
  e.drift_sigma = 1e-7;
  EXPECT_EQ(camera_to_imu(e, camera()).remarks.size(), 1u);
  e.drift_sigma = 1e-6;
  EXPECT_TRUE(camera_to_imu(e, camera()).remarks.empty());
}

TEST(Exports, EveryFormatSaysWhatItWroteAndWhatIsMissing) {
  for (const ExportFormat& format : export_formats()) {
    Estimate e = answer();
    e.T_reference_sensor.reset();
    e.line_delay_s = 1e-5;
    e.drift = 1e-5;
    const CameraToImu c = camera_to_imu(e, std::nullopt);
    EXPECT_EQ(c.remarks.size(), 2u);
    const Exported out = format.write(c);
    EXPECT_NE(out.sentence.find("cam0 is 12.346 ± 0.010 ms late against imu0"), std::string::npos)
        << format.name << ": " << out.sentence;
    EXPECT_EQ(out.text.find("nan"), std::string::npos);
  }
  EXPECT_EQ(export_format("excel"), nullptr);
}

}  // namespace
}  // namespace takt
