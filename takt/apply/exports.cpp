// SPDX-License-Identifier: Apache-2.0
#include "takt/apply/exports.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "takt/calibration/words.h"
#include "takt/error.h"

namespace takt {

namespace {

bool sounds_like(const std::string& name, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* w) { return name.find(w) != std::string::npos; });
}
/// An IMU in a camera's housing ("/camera/imu") is none.
bool is_camera(const std::string& name) {
  return sounds_like(name, {"image", "video", "frame"}) ||
         (sounds_like(name, {"cam"}) && !sounds_like(name, {"imu", "gyr"}));
}
bool is_imu(const std::string& name) {
  return sounds_like(name, {"imu", "gyr"}) && !is_camera(name);
}

bool is_turned(const Estimate& e) {
  return is_camera(e.reference) && is_imu(e.sensor);
}

}  // namespace

bool of_two_imus(const Estimate& result) {
  return is_imu(result.sensor) && is_imu(result.reference);
}

std::string camera_of(const Estimate& result) {
  if (of_two_imus(result))
    throw Error(fmt::format("is an IMU as {} is, and these files are of a camera and an IMU", result.reference),
                result.sensor, "restamp with takt apply; takt calibrate --kalibr writes Kalibr's file of IMUs");
  return is_turned(result) ? result.reference : result.sensor;
}

CameraToImu camera_to_imu(const Estimate& given, const std::optional<CameraModel>& model) {
  if (!given.offset) throw std::logic_error("camera_to_imu: the result has no answer");
  CameraToImu out;
  out.camera = camera_of(given);
  const Estimate result = is_turned(given) ? inverse(given) : given;
  out.imu = result.reference;
  out.shift_ns = result.offset->count();
  out.epoch = result.epoch;
  out.drift = result.drift.value_or(0);
  out.T_imu_cam = result.T_reference_sensor;
  out.pieces = result.pieces;
  out.sigma_s = result.sigma_s;
  out.model = model;
  out.middle_row = result.frame_row == "middle";

  if (result.line_delay_s && *result.line_delay_s != 0) {
    if (model && model->height > 0) out.readout_s = *result.line_delay_s * model->height;
    if (out.readout_s && !out.middle_row) {
      const std::int64_t half = from_seconds(0.5 * *out.readout_s).count();
      out.shift_ns += half;
      for (OffsetPiece& p : out.pieces) p.offset += Duration(half);
      out.middle_row = true;
      out.remarks.push_back(fmt::format("half the readout of {} was added: the offset is now that of the middle row",
                                        time_words(*out.readout_s, std::nullopt)));
    } else if (!out.readout_s) {
      out.remarks.emplace_back(
          "the shutter rolls, but the number of rows is not known: give --intrinsics, so that the readout can be "
          "written and the offset moved to the middle row");
    }
  }
  if (result.frame_instant && *result.frame_instant != "middle")
    out.remarks.push_back(fmt::format(
        "the offset is that of the {} of the exposure, and these tools see its middle: half the exposure has to be {}, "
        "or restamp with takt apply --instant middle",
        *result.frame_instant, *result.frame_instant == "start" ? "added" : "taken off"));
  if (out.rotation_alone())
    out.remarks.emplace_back(
        "the result has the mounting's rotation and no translation, where zeros were written: put in your own");
  const bool drifts = out.drift != 0 && !(result.drift_sigma && std::abs(out.drift) < 2 * *result.drift_sigma);
  if (drifts || out.pieces.size() > 1)
    out.remarks.push_back(
        fmt::format("the offset moves by {:.3g} ppm; what was written holds at {} ns of {}'s clock, so restamp with "
                    "takt apply where that matters",
                    1e6 * out.drift, to_ns(out.epoch), out.camera));
  return out;
}

const std::vector<ExportFormat>& export_formats() {
  static const std::vector<ExportFormat> table{
      {"basalt", ".json", export_basalt},         {"fastlivo2", ".yaml", export_fastlivo2},
      {"gyroflow", ".gyroflow", export_gyroflow}, {"ikalibr", ".yaml", export_ikalibr},
      {"kalibr", ".yaml", export_kalibr},         {"kimera", ".yaml", export_kimera},
      {"okvis", ".yaml", export_okvis},           {"openvins", ".yaml", export_openvins},
      {"orbslam3", ".yaml", export_orbslam3},     {"vins", ".yaml", export_vins},
  };
  return table;
}

const ExportFormat* export_format(const std::string& name) {
  const auto& all = export_formats();
  const auto found = std::find_if(all.begin(), all.end(), [&](const ExportFormat& f) { return name == f.name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace takt
