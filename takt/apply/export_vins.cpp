// SPDX-License-Identifier: Apache-2.0
// VINS-Mono and VINS-Fusion: td with t_imu = t_image + td; rows of a rolling shutter count from the picture's centre.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_vins(const CameraToImu& c) {
  std::string text = opencv_head + head_comment(c);
  text += "# 1 refines it online\nestimate_td: 0\n";
  text += fmt::format("td: {}\n", seconds(c.shift_ns));
  text += fmt::format("rolling_shutter: {}\nrolling_shutter_tr: {}\n", c.readout_s ? 1 : 0,
                      number(c.readout_s.value_or(0)));
  text += mounting_comment(c);
  if (c.T_imu_cam) {
    const Mat4& T = *c.T_imu_cam;
    text += "# for VINS-Fusion\n" + opencv_matrix("body_T_cam0", T);
    text += "# for VINS-Mono\n" + opencv_matrix("extrinsicRotation", T.topLeftCorner<3, 3>());
    text += opencv_matrix("extrinsicTranslation", T.topRightCorner<3, 1>());
  }
  return {text,
          fmt::format("td {} s, which VINS adds to the image's stamps: {}", seconds(c.shift_ns), offset_words(c))};
}

}  // namespace takt
