// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/streams/camera_model.h"

namespace takt {

/// As Kalibr's files have them: "pinhole", "omni", "ds", "eucm"; "none", "radtan", "equidistant", "fov".
[[nodiscard]] const char* kalibr_name(Projection projection);
[[nodiscard]] const char* kalibr_name(Distortion distortion);

}  // namespace takt
