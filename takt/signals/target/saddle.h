// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/image.h"

namespace takt {

/// Where the picture may have the crossing of two edges, to a pixel or so.
struct Crossing {
  Vec2 pixel;
  double light_rad = 0;  ///< the direction of the two light quadrants, in ±π/2
};
/// Saddles of the picture's brightness, strongest first.
[[nodiscard]] std::vector<Crossing> find_crossings(const GrayImage& image);

/// A refined crossing.
struct Saddle {
  Vec2 pixel;
  double sigma_px = 0;  ///< of the worse direction, from what the symmetry leaves unexplained
};

/// The point about which the picture is its own half-turn: a crossing of two edges is, whatever symmetric blur it has
/// suffered, so the estimate has no bias from the angle, the lens or the motion. Least squares on
/// S(c + d) − S(c − d), with S the picture smoothed by a Gaussian of 0.8 px: sampled finely enough that nothing depends
/// on where the pixels lie. Takes the square of ±`radius` px (2 to 9) about it. Nothing where it leaves the picture,
/// moves by more than `furthest_px`, or finds no symmetry.
[[nodiscard]] std::optional<Saddle> refine_saddle(const GrayImage& image, const Vec2& start, int radius,
                                                  double furthest_px);

}  // namespace takt
