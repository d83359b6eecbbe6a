// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/image.h"
#include "takt/streams/target.h"

namespace takt {

/// A marker in the picture: its corners as those of BoardMarker (lower left, lower right, upper right, upper left as
/// seen on the board), to a pixel or two.
struct FoundMarker {
  int id = 0;
  std::array<Vec2, 4> corners;
};

/// By OpenCV's ArUco detector. Nothing for targets without markers.
[[nodiscard]] std::vector<FoundMarker> find_markers(const GrayImage& image, const Target& target);

}  // namespace takt
