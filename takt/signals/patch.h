// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/streams/image.h"

namespace takt {

/// Where a patch is in a picture: a point x of it (px from its centre) lies at `at` + shape·x.
struct PatchPlace {
  Vec2 at = Vec2::Zero();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();
};

/// The surroundings of a corner as they were seen once, to be found again under any affine warp and change of
/// brightness [Baker2004].
///
/// A tracker that only shifts its window follows not the corner but the window's centre of contrast, some pixels off:
/// when the picture turns or stretches, its answer moves against the corner by that many pixels times the turn. Over a
/// second that was half a pixel, in step with the motion. And a tracker that compares each frame with the one before
/// adds up its errors. Comparing with what was seen first, warped, does neither.
class Patch {
 public:
  /// `side` is odd. Nothing where the patch (with a margin of one pixel) does not lie in the picture, or is flat.
  [[nodiscard]] static std::optional<Patch> cut(const GrayImage& picture, const Vec2& centre, int side);

  struct Found {
    PatchPlace place;
    double correlation;  ///< of the grey values there with the patch's: 1 where they are the same
  };
  /// Searches around `start`, which must be within some two pixels. Nothing where it leaves the picture or does not
  /// settle.
  [[nodiscard]] std::optional<Found> find(const GrayImage& picture, const PatchPlace& start) const;

 private:
  static constexpr int unknowns = 6;  ///< four of the shape, two of the place
  using Solver = Eigen::Matrix<double, unknowns, unknowns>;

  int side_ = 0;
  std::vector<float> grey_;                              ///< mean 0
  std::array<std::vector<float>, unknowns> by_unknown_;  ///< free of what brightness and contrast do
  double norm_ = 0;                                      ///< of grey_
  Solver inverse_normal_ = Solver::Zero();
};

}  // namespace takt
