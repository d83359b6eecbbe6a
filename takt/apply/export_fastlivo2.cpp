// SPDX-License-Identifier: Apache-2.0
// FAST-LIVO2: img_time_offset is added to the image's stamps, imu_time_offset is taken off the IMU's.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_fastlivo2(const CameraToImu& c) {
  const std::string text =
      head_comment(c) +
      fmt::format("time_offset:\n  img_time_offset: {}\n  imu_time_offset: 0.0\n", seconds(c.shift_ns));
  return {text, fmt::format("img_time_offset {} s, which FAST-LIVO2 adds to the image's stamps, and no offset of the "
                            "IMU: {}",
                            seconds(c.shift_ns), offset_words(c))};
}

}  // namespace takt
