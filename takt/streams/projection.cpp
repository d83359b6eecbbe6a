// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "takt/streams/lens.h"

namespace takt::lens {

namespace {

/// The plane's coordinates are x/n, y/n for a denominator n(p, shape): all that the models differ in.
struct Denominator {
  double value;
  Vec3 to_point;
  Vec2 to_shape;
};

OnPlane divide(const Vec3& p, const Denominator& n) {
  OnPlane out;
  out.place = p.head<2>() / n.value;
  out.to_point = -out.place / n.value * n.to_point.transpose();
  out.to_point(0, 0) += 1 / n.value;
  out.to_point(1, 1) += 1 / n.value;
  out.to_shape = -out.place / n.value * n.to_shape.transpose();
  return out;
}

/// How far behind the camera the unified models see: z > −limit·d, from where the denominator folds.
double backward_limit(double alpha) {
  return alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
}

std::optional<Denominator> omni(double xi, const Vec3& p) {
  const double d = p.norm();
  const double limit = xi <= 1 ? xi : 1 / xi;
  if (!(p.z() > -limit * d)) return std::nullopt;
  return Denominator{p.z() + xi * d, Vec3(0, 0, 1) + xi / d * p, Vec2(d, 0)};
}

/// [Usenko2018] eq. 40.
std::optional<Denominator> double_sphere(double xi, double alpha, const Vec3& p) {
  const double d1 = p.norm();
  const double w1 = backward_limit(alpha), w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
  if (!(p.z() > -w2 * d1)) return std::nullopt;
  const double k = xi * d1 + p.z();
  const double d2 = std::sqrt(p.x() * p.x() + p.y() * p.y() + k * k);
  const Vec3 k_to_point = Vec3(0, 0, 1) + xi / d1 * p;
  const Vec3 d2_to_point = (Vec3(p.x(), p.y(), 0) + k * k_to_point) / d2;
  return Denominator{alpha * d2 + (1 - alpha) * k, alpha * d2_to_point + (1 - alpha) * k_to_point,
                     Vec2(alpha * k * d1 / d2 + (1 - alpha) * d1, d2 - k)};
}

/// [Khomutenko2016] eq. 5.
std::optional<Denominator> eucm(double alpha, double beta, const Vec3& p) {
  const double r2 = p.x() * p.x() + p.y() * p.y();
  const double d = std::sqrt(beta * r2 + p.z() * p.z());
  if (!(p.z() > -backward_limit(alpha) * d)) return std::nullopt;
  const Vec3 d_to_point = Vec3(beta * p.x(), beta * p.y(), p.z()) / d;
  return Denominator{alpha * d + (1 - alpha) * p.z(), alpha * d_to_point + (1 - alpha) * Vec3(0, 0, 1),
                     Vec2(d - p.z(), alpha * r2 / (2 * d))};
}

std::optional<Denominator> denominator(Projection projection, const std::array<double, 2>& s, const Vec3& p) {
  switch (projection) {
    case Projection::pinhole:
      return Denominator{p.z(), Vec3(0, 0, 1), Vec2::Zero()};
    case Projection::omni:
      return omni(s[0], p);
    case Projection::double_sphere:
      return double_sphere(s[0], s[1], p);
    case Projection::eucm:
      return eucm(s[0], s[1], p);
  }
  return std::nullopt;
}

}  // namespace

std::optional<OnPlane> to_plane(Projection projection, const std::array<double, 2>& shape, const Vec3& p) {
  const auto n = denominator(projection, shape, p);
  if (!n || !(n->value > 1e-9)) return std::nullopt;
  return divide(p, *n);
}

std::optional<Vec3> from_plane(Projection projection, const std::array<double, 2>& shape, const Vec2& m) {
  const double r2 = m.squaredNorm();
  switch (projection) {
    case Projection::pinhole:
      return Vec3(m.x(), m.y(), 1);
    case Projection::omni: {
      const double xi = shape[0], root = 1 + (1 - xi * xi) * r2;
      if (!(root >= 0)) return std::nullopt;
      const double stretch = (xi + std::sqrt(root)) / (1 + r2);
      return Vec3(stretch * m.x(), stretch * m.y(), stretch - xi);
    }
    case Projection::double_sphere: {  // [Usenko2018] eq. 46
      const auto [xi, alpha] = shape;
      const double root = 1 - (2 * alpha - 1) * r2;
      if (!(root >= 0)) return std::nullopt;
      const double z = (1 - alpha * alpha * r2) / (alpha * std::sqrt(root) + 1 - alpha);
      const double inner = z * z + (1 - xi * xi) * r2;
      if (!(inner >= 0)) return std::nullopt;
      const double stretch = (z * xi + std::sqrt(inner)) / (z * z + r2);
      return Vec3(stretch * m.x(), stretch * m.y(), stretch * z - xi);
    }
    case Projection::eucm: {  // [Khomutenko2016] eq. 15
      const auto [alpha, beta] = shape;
      const double root = 1 - (2 * alpha - 1) * beta * r2;
      if (!(root >= 0)) return std::nullopt;
      return Vec3(m.x(), m.y(), (1 - beta * alpha * alpha * r2) / (alpha * std::sqrt(root) + 1 - alpha));
    }
  }
  return std::nullopt;
}

}  // namespace takt::lens
