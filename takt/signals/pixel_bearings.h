// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "takt/streams/camera_model.h"
#include "takt/streams/frame_timing.h"
#include "takt/streams/rotation_signal.h"

namespace takt {

/// A feature in one frame: BearingMatch is made of two.
struct SeenBearing {
  Eigen::Vector3f bearing;
  float row = 0;
  float sigma_rad = 0;
};
[[nodiscard]] BearingMatch match(const SeenBearing& from, const SeenBearing& to);

/// Turns pixels of one camera into bearings with their rows.
class PixelBearings {
 public:
  PixelBearings(const CameraModel& model, const FrameTiming& timing, int image_height)
      : model_(model),
        height_(image_height),
        first_row_(timing.row == RowReference::first ? 0 : 0.5 * (image_height - 1)) {}

  /// `sigma_px` is that of one position on one axis. Nothing where the camera model has no bearing.
  [[nodiscard]] std::optional<SeenBearing> see(const Vec2& px, double sigma_px) const;

  /// Where a feature is expected after the camera turned by `R_from_to`, for things far away.
  [[nodiscard]] std::optional<Vec2> turned(const Vec2& from_px, const Mat3& R_from_to) const;

  /// Angle that one pixel spans around `px` (rad): the geometric mean of both directions.
  [[nodiscard]] double radians_per_px(const Vec2& px) const;

 private:
  [[nodiscard]] float row(const Vec2& px) const { return static_cast<float>((px.y() - first_row_) / height_); }

  CameraModel model_;
  double height_;
  double first_row_;
};

}  // namespace takt
