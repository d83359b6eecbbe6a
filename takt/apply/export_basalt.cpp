// SPDX-License-Identifier: Apache-2.0
// Basalt's calibration: cam_time_offset_ns is added to the stamps of all cameras.
#include <fmt/core.h>

#include <Eigen/Geometry>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_basalt(const CameraToImu& c) {
  std::string text = "{\n  \"value0\": {\n";
  if (c.T_imu_cam) {
    const Eigen::Quaterniond q(c.T_imu_cam->topLeftCorner<3, 3>());
    const auto p = c.T_imu_cam->topRightCorner<3, 1>();
    text += fmt::format(
        "    \"T_imu_cam\": [\n      {{\"px\": {}, \"py\": {}, \"pz\": {}, \"qx\": {}, \"qy\": {}, \"qz\": {}, \"qw\": "
        "{}}}\n    ],\n",
        number(p.x()), number(p.y()), number(p.z()), number(q.x()), number(q.y()), number(q.z()), number(q.w()));
  }
  if (c.model) text += fmt::format("    \"resolution\": [[{}, {}]],\n", c.model->width, c.model->height);
  text += fmt::format("    \"cam_time_offset_ns\": {}\n  }}\n}}\n", c.shift_ns);
  return {text, fmt::format("cam_time_offset_ns {}, which Basalt adds to the stamps of all cameras (its VIO may ignore "
                            "it: then restamp with takt apply): {}",
                            c.shift_ns, offset_words(c))};
}

}  // namespace takt
