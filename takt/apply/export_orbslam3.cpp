// SPDX-License-Identifier: Apache-2.0
// ORB-SLAM3 has no field for an offset: only the mounting can be written. IMU.T_b_c1 takes points camera -> IMU.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_orbslam3(const CameraToImu& c) {
  std::string text = opencv_head + head_comment(c);
  text += "# ORB-SLAM3 has no field for this offset: give it a recording restamped by takt apply\n";
  text += mounting_comment(c);
  // Its values are taken for floats without a look at their type.
  if (c.T_imu_cam) text += opencv_matrix("IMU.T_b_c1", *c.T_imu_cam, 'f');
  return {text, fmt::format("{} and no offset, for which ORB-SLAM3 has no field: restamp with takt apply, since {}",
                            c.T_imu_cam ? "the mounting (IMU.T_b_c1)" : "no mounting, which the result does not have,",
                            offset_words(c))};
}

}  // namespace takt
