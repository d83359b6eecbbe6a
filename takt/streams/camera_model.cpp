// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/camera_model.h"

#include <cmath>
#include <limits>

namespace takt {

namespace {

struct Distorted {
  Vec2 point;
  Eigen::Matrix2d jacobian;
};

/// Kalibr's radial-tangential model on normalised coordinates, with its Jacobian.
Distorted radtan(const Vec2& n, const std::array<double, 4>& c) {
  const double x = n.x(), y = n.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (c[0] + r2 * c[1]);
  const double d_radial = c[0] + 2 * c[1] * r2;  // d radial / d r²
  Distorted out;
  out.point = {x * radial + 2 * c[2] * x * y + c[3] * (r2 + 2 * x * x),
               y * radial + 2 * c[3] * x * y + c[2] * (r2 + 2 * y * y)};
  const double cross = 2 * x * y * d_radial + 2 * c[2] * x + 2 * c[3] * y;
  out.jacobian << radial + 2 * x * x * d_radial + 2 * c[2] * y + 6 * c[3] * x, cross, cross,
      radial + 2 * y * y * d_radial + 2 * c[3] * x + 6 * c[2] * y;
  return out;
}

/// The r² up to which the radial polynomial rises: the smallest positive root of 1 + 3k1·r² + 5k2·r⁴.
/// Beyond it the polynomial folds back (and may rise again), so that a point far outside would appear inside.
double radtan_fold(const std::array<double, 4>& c) {
  const double a = 5 * c[1], b = 3 * c[0], discriminant = b * b - 4 * a;
  if (discriminant < 0) return std::numeric_limits<double>::infinity();
  const double root = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  const double first = 1 / root, second = root / a;  // a may be 0: then `second` is no root
  double fold = std::numeric_limits<double>::infinity();
  for (const double s : {first, second})
    if (s > 0 && s < fold) fold = s;
  return fold;
}

/// Kannala–Brandt: r = θ(1 + k1θ² + k2θ⁴ + k3θ⁶ + k4θ⁸), and dr/dθ.
std::pair<double, double> equidistant(double theta, const std::array<double, 4>& k) {
  const double t2 = theta * theta;
  const double poly = 1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])));
  const double slope = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
  return {theta * poly, slope};
}

}  // namespace

std::optional<Vec2> CameraModel::project(const Vec3& p) const {
  Vec2 d;
  if (distortion == Distortion::equidistant) {
    const double rho = std::hypot(p.x(), p.y());
    const double theta = std::atan2(rho, p.z());
    const auto [r, slope] = equidistant(theta, coeffs);
    if (slope <= 0 || !(p.squaredNorm() > 0)) return std::nullopt;
    d = rho > 1e-12 ? Vec2(p.x() * r / rho, p.y() * r / rho) : Vec2(0, 0);
  } else {
    if (p.z() <= 1e-9) return std::nullopt;
    const Vec2 n(p.x() / p.z(), p.y() / p.z());
    if (distortion == Distortion::none) {
      d = n;
    } else {
      const Distorted out = radtan(n, coeffs);
      if (n.squaredNorm() >= radtan_fold(coeffs) || out.jacobian.determinant() <= 0) return std::nullopt;
      d = out.point;
    }
  }
  return Vec2(fx * d.x() + cx, fy * d.y() + cy);
}

std::optional<Vec3> CameraModel::bearing(const Vec2& pixel) const {
  const Vec2 d((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!d.allFinite()) return std::nullopt;
  switch (distortion) {
    case Distortion::none:
      return Vec3(d.x(), d.y(), 1).normalized();
    case Distortion::radtan: {
      Vec2 n = d;
      for (int i = 0; i < 30; ++i) {
        const Distorted out = radtan(n, coeffs);
        if (out.jacobian.determinant() <= 1e-6) return std::nullopt;
        const Vec2 step = out.jacobian.inverse() * (d - out.point);
        n += step;
        if (step.squaredNorm() < 1e-24) return Vec3(n.x(), n.y(), 1).normalized();
      }
      return std::nullopt;
    }
    case Distortion::equidistant: {
      const double r = d.norm();
      if (r < 1e-12) return Vec3(0, 0, 1);
      double theta = r;
      for (int i = 0; i < 30; ++i) {
        const auto [value, slope] = equidistant(theta, coeffs);
        if (slope <= 1e-6) return std::nullopt;
        const double step = (r - value) / slope;
        theta += step;
        if (std::abs(step) < 1e-12) {
          if (theta < 0 || theta > 3.14) return std::nullopt;
          const double s = std::sin(theta) / r;
          return Vec3(s * d.x(), s * d.y(), std::cos(theta));
        }
      }
      return std::nullopt;
    }
  }
  return std::nullopt;
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

}  // namespace takt
