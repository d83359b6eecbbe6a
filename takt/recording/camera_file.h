// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/streams/camera_model.h"

namespace takt {

/// Intrinsics from an ASL sensor.yaml, or from a Kalibr camchain (the entry named `camera`, else cam0).
/// Throws takt::Error where there are none.
[[nodiscard]] CameraModel read_camera_file(const std::string& path, const std::string& camera);

}  // namespace takt
