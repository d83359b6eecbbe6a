// SPDX-License-Identifier: Apache-2.0
// OKVIS: image_delay is taken off the image's stamps, so its sign is the opposite. T_SC takes points camera -> IMU.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_okvis(const CameraToImu& c) {
  std::string text = opencv_head + head_comment(c);
  text += mounting_comment(c);
  if (c.T_imu_cam) text += fmt::format("cameras:\n   - {{ T_SC: {} }}\n", list(row_major(*c.T_imu_cam)));
  // Each reads its own field and passes over the other's.
  text += fmt::format("# for OKVIS2\ncamera_parameters:\n   image_delay: {0}\n# for OKVIS\nimageDelay: {0}\n",
                      seconds(-c.shift_ns));
  return {text, fmt::format("image_delay {} s, which OKVIS takes off the image's stamps: {}", seconds(-c.shift_ns),
                            offset_words(c))};
}

}  // namespace takt
