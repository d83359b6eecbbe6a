// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/image.h"
#include "takt/streams/target.h"

namespace takt {

/// All corners of a checkerboard, or all discs of a circle grid, in the order of its points, to a pixel; nothing unless
/// all are in the picture. A board that looks the same upside down is taken as standing upright.
[[nodiscard]] std::vector<Vec2> find_grid(const GrayImage& image, const Target& target);

}  // namespace takt
