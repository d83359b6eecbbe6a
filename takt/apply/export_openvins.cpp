// SPDX-License-Identifier: Apache-2.0
// OpenVINS' kalibr_imucam_chain.yaml: timeshift_cam_imu with t_imu = t_cam + shift. Only cam0's is read.
#include <fmt/core.h>

#include "takt/apply/export_text.h"
#include "takt/error.h"
#include "takt/streams/kalibr_names.h"

namespace takt {

using namespace export_text;

namespace {

/// OpenVINS takes any lens that is not equidistant for radtan, and any camera for a pinhole.
CameraToImu with_its_lens(CameraToImu c) {
  if (!c.model) return c;
  CameraModel& m = *c.model;
  if (m.distortion == Distortion::none) m.distortion = Distortion::radtan;  // its numbers are zeros
  if (m.projection != Projection::pinhole || m.distortion == Distortion::fov)
    throw Error(fmt::format("OpenVINS has pinhole cameras with radtan or equidistant lenses, not {}-{}",
                            kalibr_name(m.projection), kalibr_name(m.distortion)),
                c.camera, "calibrate the camera with one of these, or export without --intrinsics");
  return c;
}

}  // namespace

Exported export_openvins(const CameraToImu& given) {
  const CameraToImu c = with_its_lens(given);
  std::string text = opencv_head + head_comment(c) + "cam0:\n" + kalibr_camera(c, 2);
  text += mounting_comment(c);
  if (c.T_imu_cam) text += matrix_rows("T_imu_cam", *c.T_imu_cam, 2);
  text += fmt::format("  rostopic: \"{}\"\n  timeshift_cam_imu: {}\n", c.camera, seconds(c.shift_ns));
  text += fmt::format(
      "# for other readers; OpenVINS' own calib_cam_timeoffset (estimator_config.yaml) is a switch, which "
      "lets it refine the value above\ncalib_cam_timeoffset: {}\n",
      seconds(c.shift_ns));
  return {text,
          fmt::format("timeshift_cam_imu {} s, which OpenVINS adds to the camera's stamps{}: {}", seconds(c.shift_ns),
                      c.model ? "" : "; it needs the lens too (--intrinsics)", offset_words(c))};
}

}  // namespace takt
