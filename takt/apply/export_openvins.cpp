// SPDX-License-Identifier: Apache-2.0
// OpenVINS' kalibr_imucam_chain.yaml, and its calib_cam_timeoffset: t_imu = t_cam + offset. Only cam0's is read.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_openvins(const CameraToImu& c) {
  std::string text = opencv_head + head_comment(c) + "cam0:\n" + kalibr_camera(c, 2);
  if (c.T_imu_cam) text += matrix_rows("T_imu_cam", *c.T_imu_cam, 2);
  text += fmt::format("  rostopic: \"{}\"\n  timeshift_cam_imu: {}\n", c.camera, seconds(c.shift_ns));
  text += fmt::format("# the starting value of estimator_config.yaml\ncalib_cam_timeoffset: {}\n", seconds(c.shift_ns));
  return {text, fmt::format("timeshift_cam_imu and calib_cam_timeoffset {} s, which OpenVINS adds to the camera's "
                            "stamps: {}",
                            seconds(c.shift_ns), offset_words(c))};
}

}  // namespace takt
