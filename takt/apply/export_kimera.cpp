// SPDX-License-Identifier: Apache-2.0
// Kimera-VIO's ImuParams.yaml: imu_time_shift with t_imu = t_cam + shift.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_kimera(const CameraToImu& c) {
  std::string text = opencv_head + head_comment(c);
  text += "# for ImuParams.yaml; its own coarse alignment would come on top\ndo_imu_rate_time_alignment: 0\n";
  text += fmt::format("imu_time_shift: {}\n", seconds(c.shift_ns));
  text += mounting_comment(c);
  if (c.T_imu_cam)
    text += fmt::format(
        "# for LeftCameraParams.yaml, where the body is the IMU\nT_BS:\n   cols: 4\n   rows: 4\n   "
        "data: {}\n",
        list(row_major(*c.T_imu_cam)));
  return {text, fmt::format("imu_time_shift {} s with Kimera's t_imu = t_cam + shift: {}", seconds(c.shift_ns),
                            offset_words(c))};
}

}  // namespace takt
