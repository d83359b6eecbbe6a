// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/streams/camera_model.h"

/// Results in the files of other tools: sign, unit and row reference as each of them has it (docs/formats/exports.md).
namespace takt {

/// What a result says of a camera and an IMU, in the form from which every tool's fields follow:
///   t_imu = t_cam + shift, for one instant a frame.
struct CameraToImu {
  std::string camera, imu;
  std::int64_t shift_ns = 0;  ///< at `epoch`
  std::optional<double> sigma_s;
  Stamp epoch{};  ///< on the camera's clock
  double drift = 0;
  std::vector<OffsetPiece> pieces;  ///< where one line is not enough; shifted like `shift_ns`
  bool middle_row = false;          ///< the shift is for the middle row; else for the first, or all rows are one
  std::optional<double> readout_s;  ///< first row to last, plus one line; nothing where it or the rows are unknown
  std::optional<Mat4> T_imu_cam;    ///< takes points camera -> IMU
  std::optional<CameraModel> model;
  std::vector<std::string> remarks;  ///< what the user should know, in sentences

  [[nodiscard]] double shift_s() const { return static_cast<double>(shift_ns) * 1e-9; }
  /// Methods that use rates alone find how the camera is turned, not where it is: they leave the translation at zero.
  [[nodiscard]] bool rotation_alone() const { return T_imu_cam && T_imu_cam->topRightCorner<3, 1>().isZero(0); }
};

/// Whether it is of two IMUs, by their names: no tool's file of a camera has a field for that.
[[nodiscard]] bool of_two_imus(const Estimate& result);
/// The name of the camera in a result, which may be its sensor or its reference. Throws takt::Error for two IMUs.
[[nodiscard]] std::string camera_of(const Estimate& result);

/// Turns a result round where its sensor is the IMU, and moves an offset of the first row to the middle one where the
/// readout is known: the tools take a frame for one instant, which is the middle of its rows. Throws std::logic_error
/// where the result has no answer.
/// Throws takt::Error where both are IMUs.
[[nodiscard]] CameraToImu camera_to_imu(const Estimate& result, const std::optional<CameraModel>& model);

struct Exported {
  std::string text;
  std::string sentence;  ///< what was written, in words
};

/// One row a tool; a new one is one file export_<tool>.cpp and a row in exports.cpp.
struct ExportFormat {
  const char* name;
  const char* ending;
  Exported (*write)(const CameraToImu& c);
};
[[nodiscard]] const std::vector<ExportFormat>& export_formats();
/// nullptr where there is no such tool.
[[nodiscard]] const ExportFormat* export_format(const std::string& name);

[[nodiscard]] Exported export_basalt(const CameraToImu& c);
[[nodiscard]] Exported export_fastlivo2(const CameraToImu& c);
[[nodiscard]] Exported export_gyroflow(const CameraToImu& c);
[[nodiscard]] Exported export_ikalibr(const CameraToImu& c);
[[nodiscard]] Exported export_kalibr(const CameraToImu& c);
[[nodiscard]] Exported export_kimera(const CameraToImu& c);
[[nodiscard]] Exported export_okvis(const CameraToImu& c);
[[nodiscard]] Exported export_openvins(const CameraToImu& c);
[[nodiscard]] Exported export_orbslam3(const CameraToImu& c);
[[nodiscard]] Exported export_vins(const CameraToImu& c);

}  // namespace takt
