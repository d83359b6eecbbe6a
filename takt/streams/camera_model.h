// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>
#include <string>

#include "takt/motion/rotation.h"

namespace takt {

enum class Distortion { none, radtan, equidistant };

/// Pinhole camera with Kalibr's distortion models. Pixels: (0, 0) is the centre of the upper left pixel.
/// Camera frame: x right, y down, z forward.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px
  Distortion distortion = Distortion::none;
  std::array<double, 4> coeffs{};  ///< radtan k1 k2 p1 p2; equidistant k1 k2 k3 k4

  /// Where a point in camera coordinates is seen (px); nothing for points at or behind the camera, or beyond the
  /// angle where the distortion polynomial folds back.
  [[nodiscard]] std::optional<Vec2> project(const Vec3& p_cam) const;
  /// Unit bearing of a pixel; nothing where the distortion cannot be undone (far outside the image circle).
  [[nodiscard]] std::optional<Vec3> bearing(const Vec2& pixel) const;

  /// Undistorted pinhole of a given horizontal field of view (rad): a stated default where nothing is known.
  [[nodiscard]] static CameraModel from_horizontal_fov(int width, int height, double fov_rad);
};

}  // namespace takt
