// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "takt/motion/rotation.h"
#include "takt/streams/image.h"

namespace takt {

struct Disc {
  Vec2 pixel;
  double area_px2 = 0;
};

/// The centroid of a dark disc's ink within `reach_px` (half the distance to its neighbours) of a first guess, weighted
/// by how dark each pixel is between the disc's grey and the paper's. In perspective it is not the centre's image.
[[nodiscard]] std::optional<Disc> refine_disc(const GrayImage& image, const Vec2& start, double reach_px);

}  // namespace takt
