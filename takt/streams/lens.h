// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>

#include "takt/streams/camera_model.h"

/// The two steps of a camera model before its focal length: direction -> plane -> distorted plane.
namespace takt::lens {

/// A place on the plane, and how it moves with the point and with the projection's shape.
struct OnPlane {
  Vec2 place;
  Eigen::Matrix<double, 2, 3> to_point;
  Eigen::Matrix2d to_shape = Eigen::Matrix2d::Zero();
};
/// Nothing for points that the projection cannot see.
[[nodiscard]] std::optional<OnPlane> to_plane(Projection projection, const std::array<double, 2>& shape, const Vec3& p);
/// The direction that is seen at a place, of any length.
[[nodiscard]] std::optional<Vec3> from_plane(Projection projection, const std::array<double, 2>& shape, const Vec2& m);

/// A distorted place, and how it moves with the undistorted one and with the coefficients.
struct Distorted {
  Vec2 place;
  Eigen::Matrix2d to_place;
  Eigen::Matrix<double, 2, 4> to_coeffs = Eigen::Matrix<double, 2, 4>::Zero();
};
/// Nothing beyond the radius where the distortion folds back.
[[nodiscard]] std::optional<Distorted> distort(Distortion distortion, const std::array<double, 4>& coeffs,
                                               const Vec2& m);
[[nodiscard]] std::optional<Vec2> undistort(Distortion distortion, const std::array<double, 4>& coeffs, const Vec2& d);

/// Kannala–Brandt on the angle itself, so that a fisheye sees beside and behind itself too.
struct Fisheye {
  Vec2 place;
  Eigen::Matrix<double, 2, 3> to_point;
  Eigen::Matrix<double, 2, 4> to_coeffs;
};
[[nodiscard]] std::optional<Fisheye> fisheye(const std::array<double, 4>& coeffs, const Vec3& p);
[[nodiscard]] std::optional<Vec3> from_fisheye(const std::array<double, 4>& coeffs, const Vec2& d);

}  // namespace takt::lens
