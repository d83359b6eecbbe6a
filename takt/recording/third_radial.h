// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/streams/camera_model.h"

namespace takt {

/// Others' lenses have a k3, takt's radtan has none: adds to k1 and k2 what moves points most alike within the picture,
/// and gives the largest difference that is left (px).
[[nodiscard]] double fold_third_radial(CameraModel& m, double k3);

}  // namespace takt
