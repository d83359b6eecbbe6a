// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "takt/motion/rotation.h"

namespace takt {

/// How a point's direction becomes a place on the plane before the lens' distortion, as Kalibr names it:
///   pinhole        x/z, y/z
///   omni           the unified model: xi
///   double_sphere  [Usenko2018]: xi, alpha (Kalibr's "ds")
///   eucm           the extended unified model [Khomutenko2016]: alpha, beta
enum class Projection { pinhole, omni, double_sphere, eucm };
enum class Distortion { none, radtan, equidistant, fov };

/// A camera with one of Kalibr's models. Pixels: (0, 0) is the centre of the upper left pixel.
/// Camera frame: x right, y down, z forward.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px
  Distortion distortion = Distortion::none;
  std::array<double, 4> coeffs{};  ///< radtan k1 k2 p1 p2; equidistant k1 k2 k3 k4; fov w
  Projection projection = Projection::pinhole;
  std::array<double, 2> shape{};  ///< omni xi; double_sphere xi alpha; eucm alpha beta

  /// Where a point in camera coordinates is seen (px); nothing for points that the lens cannot see: at or behind a
  /// pinhole, or beyond the angle where the model folds back.
  [[nodiscard]] std::optional<Vec2> project(const Vec3& p_cam) const;
  /// Unit bearing of a pixel; nothing where the distortion cannot be undone (far outside the image circle).
  [[nodiscard]] std::optional<Vec3> bearing(const Vec2& pixel) const;

  /// Undistorted pinhole of a given horizontal field of view (rad): a stated default where nothing is known.
  [[nodiscard]] static CameraModel from_horizontal_fov(int width, int height, double fov_rad);
};

/// How many numbers a projection and a distortion have: of `shape`, of `coeffs`.
[[nodiscard]] int shape_count(Projection projection);
[[nodiscard]] int coeff_count(Distortion distortion);

/// The intrinsics in Kalibr's order: shape, fx, fy, cx, cy, coeffs.
using Intrinsics = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 10, 1>;
[[nodiscard]] Intrinsics intrinsics_of(const CameraModel& model);
/// The model with other numbers in the same order; throws std::invalid_argument for another count of them.
[[nodiscard]] CameraModel with_intrinsics(CameraModel model, const Intrinsics& intrinsics);
/// "xi", "fx", "k1" … in the same order.
[[nodiscard]] std::vector<std::string> intrinsic_names(const CameraModel& model);

/// A pixel and how it moves with the point (px/m) and with the intrinsics (px a unit).
struct ProjectedPoint {
  Vec2 pixel;
  Eigen::Matrix<double, 2, 3> to_point;
  Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, 10> to_intrinsics;
};
[[nodiscard]] std::optional<ProjectedPoint> project_with_jacobians(const CameraModel& model, const Vec3& p_cam);

}  // namespace takt
