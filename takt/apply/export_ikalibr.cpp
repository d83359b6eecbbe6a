// SPDX-License-Identifier: Apache-2.0
// iKalibr's parameters: TO_CmToBr with t_imu = t_cam + TO, and the readout of a rolling shutter.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_ikalibr(const CameraToImu& c) {
  std::string text = head_comment(c) + "CalibParam:\n  TEMPORAL:\n";
  text += fmt::format("    TO_CmToBr:\n      - key: \"{}\"\n        value: {}\n", c.camera, seconds(c.shift_ns));
  text += fmt::format("    RS_READOUT:\n      - key: \"{}\"\n        value: {}\n", c.camera,
                      number(c.readout_s.value_or(0)));
  return {text,
          fmt::format("TO_CmToBr {} s with iKalibr's t_imu = t_cam + TO: {}", seconds(c.shift_ns), offset_words(c))};
}

}  // namespace takt
