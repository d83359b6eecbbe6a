// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/recording/yaml_fields.h"
#include "takt/signals/dial/dial_angle.h"

namespace takt {

/// What a rig file says of the dial and of the camera before it.
struct DialRig {
  Dial dial;
  DialView view;
  DialOptions options;
};

/// Keys: dial (coded, plain), dial_radius_m, camera_distance_m; and where they differ from the printed dial's or from
/// a camera square to it: dial_height_m, graduation_deg, line_deg, cell_deg, roll_deg, yaw_deg, pitch_deg,
/// camera_height_m, rest_reading_deg. The lens is the camera's; `method` empty: coded, or keyframes on a plain dial.
/// Throws takt::Error for what is missing or cannot be, std::invalid_argument for a method that there is not.
[[nodiscard]] DialRig dial_rig(const YamlFields& rig, const CameraStream& camera, const std::string& method);

}  // namespace takt
