// SPDX-License-Identifier: Apache-2.0
// Kalibr's camchain: timeshift_cam_imu with t_imu = t_cam + shift; T_cam_imu takes points IMU -> camera.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_kalibr(const CameraToImu& c) {
  std::string text = head_comment(c) + "cam0:\n" + kalibr_camera(c, 2);
  text += mounting_comment(c);
  if (c.T_imu_cam) text += matrix_rows("T_cam_imu", c.T_imu_cam->inverse(), 2);
  if (c.readout_s && c.model) text += fmt::format("  line_delay: {}\n", number(*c.readout_s / c.model->height));
  text += fmt::format("  rostopic: {}\n  timeshift_cam_imu: {}\n", c.camera, seconds(c.shift_ns));
  return {text, fmt::format("timeshift_cam_imu {} s, which Kalibr adds to the camera's stamps: {}", seconds(c.shift_ns),
                            offset_words(c))};
}

}  // namespace takt
