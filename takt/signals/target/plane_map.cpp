// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/plane_map.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace takt {

std::optional<PlaneMap> PlaneMap::fit(std::span<const PlacedPixel> pairs) {
  if (pairs.size() < 4) return std::nullopt;
  Vec2 place = Vec2::Zero(), pixel = Vec2::Zero();
  for (const PlacedPixel& p : pairs) place += p.place, pixel += p.pixel;
  const double n = static_cast<double>(pairs.size());
  place /= n, pixel /= n;
  double place_size = 0, pixel_size = 0;
  for (const PlacedPixel& p : pairs)
    place_size += (p.place - place).squaredNorm(), pixel_size += (p.pixel - pixel).squaredNorm();
  place_size = std::sqrt(place_size / n), pixel_size = std::sqrt(pixel_size / n);
  if (!(place_size > 0) || !(pixel_size > 0)) return std::nullopt;

  Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b = Eigen::Matrix<double, 8, 1>::Zero();
  for (const PlacedPixel& p : pairs) {
    const Vec2 x = (p.place - place) / place_size, u = (p.pixel - pixel) / pixel_size;
    Eigen::Matrix<double, 8, 1> row;
    for (int k = 0; k < 2; ++k) {
      row.setZero();
      row.segment<3>(3 * k) << x.x(), x.y(), 1;
      row.tail<2>() = -u[k] * x;
      A.selfadjointView<Eigen::Lower>().rankUpdate(row);
      b += u[k] * row;
    }
  }
  const Eigen::LDLT<Eigen::Matrix<double, 8, 8>> solver(A.selfadjointView<Eigen::Lower>());
  const auto D = solver.vectorD();
  if (solver.info() != Eigen::Success || !(D.minCoeff() > 1e-9 * D.maxCoeff())) return std::nullopt;
  const Eigen::Matrix<double, 8, 1> h = solver.solve(b);
  Mat3 H, to_pixel = Mat3::Identity(), from_place = Mat3::Identity();
  H << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  to_pixel.topLeftCorner<2, 2>() *= pixel_size;
  to_pixel.topRightCorner<2, 1>() = pixel;
  from_place.topLeftCorner<2, 2>() /= place_size;
  from_place.topRightCorner<2, 1>() = -place / place_size;
  PlaneMap map;
  map.H_ = to_pixel * H * from_place;
  return map;
}

std::optional<Vec2> PlaneMap::operator()(const Vec2& place) const {
  const Vec3 h = H_ * place.homogeneous();
  if (!(h.z() > 1e-3)) return std::nullopt;
  return h.hnormalized();
}

Eigen::Matrix2d PlaneMap::slope(const Vec2& place) const {
  const Vec3 h = H_ * place.homogeneous();
  const Vec2 pixel = h.hnormalized();
  return (H_.topLeftCorner<2, 2>() - pixel * H_.row(2).head<2>()) / h.z();
}

Vec2 PlaneMap::circle_shift(const Vec2& centre, double radius) const {
  // The dual conic moves as H·C*·Hᵀ, and its last column is the ellipse's middle.
  const Vec3 c(centre.x(), centre.y(), 1);
  Mat3 dual = c * c.transpose();
  dual(0, 0) -= radius * radius, dual(1, 1) -= radius * radius;
  const Vec3 middle = H_ * dual * H_.row(2).transpose();
  return middle.hnormalized() - Vec3(H_ * c).hnormalized();
}

}  // namespace takt
