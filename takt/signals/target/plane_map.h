// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>

#include "takt/motion/rotation.h"

namespace takt {

/// One place of a plane and where it is seen.
struct PlacedPixel {
  Vec2 place;
  Vec2 pixel;
};

/// A map of a plane to the picture: a homography about its own middle, for numbers of order 1.
class PlaneMap {
 public:
  /// Least squares over at least 4 pairs (weights all alike); nothing where they are collinear.
  [[nodiscard]] static std::optional<PlaneMap> fit(std::span<const PlacedPixel> pairs);
  /// Nothing beyond the map's horizon.
  [[nodiscard]] std::optional<Vec2> operator()(const Vec2& place) const;
  /// How the pixel moves with the place (px/m).
  [[nodiscard]] Eigen::Matrix2d slope(const Vec2& place) const;
  /// Where the middle of a circle's image lies off the image of its middle (px): in perspective they differ.
  [[nodiscard]] Vec2 circle_shift(const Vec2& centre, double radius) const;

 private:
  Mat3 H_ = Mat3::Identity();
};

}  // namespace takt
