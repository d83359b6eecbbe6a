// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/streams/streams.h"
#include "takt/streams/target.h"

/// Kalibr's files, read and written: target.yaml, camchain(-imucam).yaml, imu.yaml. What was written by Kalibr and is
/// read and written again is the same, byte for byte: its order of keys, its digits, its line breaks.
/// Transforms and signs are those of docs/conventions.md: p_cam = T_cam_imu·p_imu, t_imu = t_cam + timeshift_cam_imu.
namespace takt {

/// How files are written.
///   kalibr  as Kalibr itself does
///   opencv  so that OpenCV's FileStorage reads it too, and through it OpenVINS, VINS and ORB-SLAM3
enum class KalibrStyle { kalibr, opencv };

/// One camN of a camchain.
struct KalibrCamera {
  CameraModel model = {};
  std::string rostopic = {};
  std::optional<std::vector<int>> cam_overlaps = {};  ///< cameras that see the same
  std::optional<Mat4> T_cam_imu = {};
  std::optional<Mat4> T_cn_cnm1 = {};  ///< takes points from the camera before to this one
  std::optional<double> timeshift_cam_imu_s = {};
  std::optional<double> line_delay_s = {};
};
using KalibrCamchain = std::vector<KalibrCamera>;  ///< cam0, cam1 …

/// measured = M·true + bias. For gyros C_gyro_i turns from the IMU's axes to theirs, and A·acceleration is added; for
/// accelerometers the three places are where each axis stands (m).
struct KalibrTriad {
  Mat3 M = Mat3::Identity();
  std::optional<Mat3> C_gyro_i = {}, A = {};
  std::optional<Vec3> rx_i = {}, ry_i = {}, rz_i = {};
};

/// One IMU: what Kalibr is given, and from `model` on what it adds to its result.
struct KalibrImu {
  ImuNoise noise = {};
  double update_rate_hz = 200;
  std::string rostopic = {};
  std::optional<std::string> model = {};     ///< calibrated, scale-misalignment, scale-misalignment-size-effect
  std::optional<Mat4> T_i_b = {};            ///< takes points from imu0 to this IMU
  std::optional<double> time_offset_s = {};  ///< t_imu0 = t_imu + time_offset
  std::optional<KalibrTriad> accelerometers = {}, gyroscopes = {};
};

/// Each throws takt::Error naming `where` and the key that is wrong or missing.
[[nodiscard]] Target read_kalibr_target(std::string_view text, const std::string& where);
[[nodiscard]] KalibrCamchain read_kalibr_camchain(std::string_view text, const std::string& where);
/// One IMU, as Kalibr is given it, or a map of imu0, imu1 …, as it writes them.
[[nodiscard]] std::vector<KalibrImu> read_kalibr_imus(std::string_view text, const std::string& where);

[[nodiscard]] std::string write_kalibr_target(const Target& target, KalibrStyle style = KalibrStyle::kalibr);
[[nodiscard]] std::string write_kalibr_camchain(const KalibrCamchain& chain, KalibrStyle style = KalibrStyle::kalibr);
/// A single IMU without results is written flat, as Kalibr is given it; others as imu0, imu1 …
[[nodiscard]] std::string write_kalibr_imus(const std::vector<KalibrImu>& imus,
                                            KalibrStyle style = KalibrStyle::kalibr);

/// The same from a file.
[[nodiscard]] Target read_kalibr_target_file(const std::string& path);
[[nodiscard]] KalibrCamchain read_kalibr_camchain_file(const std::string& path);
[[nodiscard]] std::vector<KalibrImu> read_kalibr_imus_file(const std::string& path);

}  // namespace takt
