// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/camera_model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "takt/streams/lens.h"

namespace takt {

namespace {

bool is_fisheye(const CameraModel& m) {
  return m.projection == Projection::pinhole && m.distortion == Distortion::equidistant;
}

}  // namespace

std::optional<Vec2> CameraModel::project(const Vec3& p) const {
  const auto in_pixels = [this](const Vec2& d) { return Vec2(fx * d.x() + cx, fy * d.y() + cy); };
  if (is_fisheye(*this)) {
    const auto seen = lens::fisheye(coeffs, p);
    return seen ? std::optional(in_pixels(seen->place)) : std::nullopt;
  }
  const auto on_plane = lens::to_plane(projection, shape, p);
  if (!on_plane) return std::nullopt;
  const auto bent = lens::distort(distortion, coeffs, on_plane->place);
  return bent ? std::optional(in_pixels(bent->place)) : std::nullopt;
}

std::optional<Vec3> CameraModel::bearing(const Vec2& pixel) const {
  const Vec2 d((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!d.allFinite()) return std::nullopt;
  if (is_fisheye(*this)) return lens::from_fisheye(coeffs, d);
  const auto place = lens::undistort(distortion, coeffs, d);
  const auto direction = place ? lens::from_plane(projection, shape, *place) : std::nullopt;
  return direction ? std::optional(direction->normalized()) : std::nullopt;
}

CameraModel CameraModel::from_horizontal_fov(int width, int height, double fov_rad) {
  CameraModel m;
  m.width = width;
  m.height = height;
  m.fx = m.fy = 0.5 * width / std::tan(0.5 * fov_rad);
  m.cx = 0.5 * (width - 1);
  m.cy = 0.5 * (height - 1);
  return m;
}

int shape_count(Projection projection) {
  switch (projection) {
    case Projection::pinhole:
      return 0;
    case Projection::omni:
      return 1;
    case Projection::double_sphere:
    case Projection::eucm:
      return 2;
  }
  return 0;
}

int coeff_count(Distortion distortion) {
  switch (distortion) {
    case Distortion::none:
      return 0;
    case Distortion::radtan:
    case Distortion::equidistant:
      return 4;
    case Distortion::fov:
      return 1;
  }
  return 0;
}

Intrinsics intrinsics_of(const CameraModel& m) {
  const int shape = shape_count(m.projection), coeffs = coeff_count(m.distortion);
  Intrinsics out(shape + 4 + coeffs);
  std::copy_n(m.shape.begin(), shape, out.data());
  out.segment<4>(shape) << m.fx, m.fy, m.cx, m.cy;
  std::copy_n(m.coeffs.begin(), coeffs, out.data() + shape + 4);
  return out;
}

CameraModel with_intrinsics(CameraModel m, const Intrinsics& v) {
  const int shape = shape_count(m.projection), coeffs = coeff_count(m.distortion);
  if (v.size() != shape + 4 + coeffs)
    throw std::invalid_argument(
        fmt::format("with_intrinsics: {} numbers, the model has {}", v.size(), shape + 4 + coeffs));
  std::copy_n(v.data(), shape, m.shape.begin());
  m.fx = v[shape], m.fy = v[shape + 1], m.cx = v[shape + 2], m.cy = v[shape + 3];
  std::copy_n(v.data() + shape + 4, coeffs, m.coeffs.begin());
  return m;
}

std::vector<std::string> intrinsic_names(const CameraModel& m) {
  std::vector<std::string> names;
  if (m.projection == Projection::omni) names = {"xi"};
  if (m.projection == Projection::double_sphere) names = {"xi", "alpha"};
  if (m.projection == Projection::eucm) names = {"alpha", "beta"};
  names.insert(names.end(), {"fx", "fy", "cx", "cy"});
  if (m.distortion == Distortion::radtan) names.insert(names.end(), {"k1", "k2", "p1", "p2"});
  if (m.distortion == Distortion::equidistant) names.insert(names.end(), {"k1", "k2", "k3", "k4"});
  if (m.distortion == Distortion::fov) names.emplace_back("w");
  return names;
}

std::optional<ProjectedPoint> project_with_jacobians(const CameraModel& m, const Vec3& p) {
  const int shape = shape_count(m.projection), coeffs = coeff_count(m.distortion);
  const Eigen::DiagonalMatrix<double, 2> focal(m.fx, m.fy);
  ProjectedPoint out;
  out.to_intrinsics.setZero(2, shape + 4 + coeffs);
  Vec2 place;
  if (is_fisheye(m)) {
    const auto seen = lens::fisheye(m.coeffs, p);
    if (!seen) return std::nullopt;
    place = seen->place;
    out.to_point = focal * seen->to_point;
    out.to_intrinsics.rightCols(coeffs) = focal * seen->to_coeffs;
  } else {
    const auto on_plane = lens::to_plane(m.projection, m.shape, p);
    if (!on_plane) return std::nullopt;
    const auto bent = lens::distort(m.distortion, m.coeffs, on_plane->place);
    if (!bent) return std::nullopt;
    place = bent->place;
    const Eigen::Matrix2d to_plane = focal * bent->to_place;
    out.to_point = to_plane * on_plane->to_point;
    out.to_intrinsics.leftCols(shape) = (to_plane * on_plane->to_shape).leftCols(shape);
    out.to_intrinsics.rightCols(coeffs) = (focal * bent->to_coeffs).leftCols(coeffs);
  }
  out.pixel = Vec2(m.fx * place.x() + m.cx, m.fy * place.y() + m.cy);
  out.to_intrinsics.block<2, 4>(0, shape) << place.x(), 0, 1, 0, 0, place.y(), 0, 1;
  return out;
}

}  // namespace takt
