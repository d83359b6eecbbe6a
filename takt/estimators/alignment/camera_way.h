// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <optional>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/motion/spline.h"

namespace takt::alignment {

/// What a pair of frames says of the camera's way between them.
struct WayPiece {
  double t0, t1;  ///< sensor seconds
  Vec3 moved;     ///< way over mean depth (rad), along the axes of one frame in which the gyro keeps all attitudes
};

/// The way of the camera over the mean depth of what it sees, as a curve in time: how it moves while a frame is read is
/// not how it moves on the whole between two frames. Its origin has no meaning; its changes within a second have.
class CameraWay {
 public:
  /// Nothing is known: no motion.
  CameraWay() = default;
  /// Robust: each piece is held against the others that run at its time. Pieces last about `length_s`; what swings
  /// faster than once in that time is not seen by them and is left out.
  CameraWay(const std::vector<WayPiece>& pieces, double length_s);

  [[nodiscard]] Vec3 between(double t0, double t1) const;

 private:
  using Spline = EuclideanSpline<3, 4>;
  [[nodiscard]] double inside(double t) const { return std::clamp(t - begin_s_, 0.0, spline_->duration_s()); }

  double begin_s_ = 0;
  std::optional<Spline> spline_;
};

}  // namespace takt::alignment
