// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "takt/streams/lens.h"

namespace takt::lens {

namespace {

using Coeffs = std::array<double, 4>;

/// Kalibr's radial-tangential model.
Distorted radtan(const Coeffs& c, const Vec2& m) {
  const double x = m.x(), y = m.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (c[0] + r2 * c[1]);
  const double d_radial = c[0] + 2 * c[1] * r2;  // d radial / d r²
  Distorted out;
  out.place = {x * radial + 2 * c[2] * x * y + c[3] * (r2 + 2 * x * x),
               y * radial + 2 * c[3] * x * y + c[2] * (r2 + 2 * y * y)};
  const double cross = 2 * x * y * d_radial + 2 * c[2] * x + 2 * c[3] * y;
  out.to_place << radial + 2 * x * x * d_radial + 2 * c[2] * y + 6 * c[3] * x, cross, cross,
      radial + 2 * y * y * d_radial + 2 * c[3] * x + 6 * c[2] * y;
  out.to_coeffs << x * r2, x * r2 * r2, 2 * x * y, r2 + 2 * x * x, y * r2, y * r2 * r2, r2 + 2 * y * y, 2 * x * y;
  return out;
}

/// The r² up to which the radial polynomial rises: the smallest positive root of 1 + 3k1·r² + 5k2·r⁴.
/// Beyond it the polynomial folds back (and may rise again), so that a point far outside would appear inside.
double radtan_fold(const Coeffs& c) {
  const double a = 5 * c[1], b = 3 * c[0], discriminant = b * b - 4 * a;
  if (discriminant < 0) return std::numeric_limits<double>::infinity();
  const double root = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  const double first = 1 / root, second = root / a;  // a may be 0: then `second` is no root
  double fold = std::numeric_limits<double>::infinity();
  for (const double s : {first, second})
    if (s > 0 && s < fold) fold = s;
  return fold;
}

/// A radial distortion: place = m·g(r), from g and g'(r)/r. `to_g` holds what the coefficients do to g.
Distorted radial(const Vec2& m, double g, double slope_over_r, const Eigen::RowVector4d& to_g) {
  Distorted out;
  out.place = g * m;
  out.to_place = g * Eigen::Matrix2d::Identity() + slope_over_r * m * m.transpose();
  out.to_coeffs = m * to_g;
  return out;
}

/// Kannala–Brandt: r = θ(1 + k1θ² + k2θ⁴ + k3θ⁶ + k4θ⁸), and dr/dθ.
std::pair<double, double> bent(const Coeffs& k, double theta) {
  const double t2 = theta * theta;
  const double poly = 1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])));
  const double slope = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
  return {theta * poly, slope};
}
Eigen::RowVector4d bent_to_coeffs(double theta) {
  const double t2 = theta * theta, t3 = theta * t2;
  return {t3, t3 * t2, t3 * t2 * t2, t3 * t2 * t2 * t2};
}

/// The angle that `bent` maps to r.
std::optional<double> unbent(const Coeffs& k, double r) {
  double theta = std::min(r, 0.5 * std::numbers::pi);
  for (int i = 0; i < 50; ++i) {
    const auto [value, slope] = bent(k, theta);
    if (slope <= 1e-6) return std::nullopt;
    const double step = std::clamp((r - value) / slope, -0.5, 0.5);
    theta += step;
    if (std::abs(step) < 1e-12) return theta >= 0 && theta <= 3.14 ? std::optional(theta) : std::nullopt;
  }
  return std::nullopt;
}

constexpr double tiny_radius = 1e-6;  // below it a radial distortion is its own series to 1e-12

Distorted equidistant(const Coeffs& k, const Vec2& m) {
  const double r = m.norm();
  if (r < tiny_radius) return radial(m, 1, 2 * (k[0] - 1.0 / 3), Eigen::RowVector4d(r * r, 0, 0, 0));
  const double theta = std::atan(r);
  const auto [value, slope] = bent(k, theta);
  const double g = value / r;
  return radial(m, g, (slope / (1 + r * r) - g) / (r * r), bent_to_coeffs(theta) / r);
}

/// Kalibr's field-of-view model [Devernay2001]: r_d = atan(2r·tan(w/2)) / w.
Distorted fov(double w, const Vec2& m) {
  const double r = m.norm(), t = 2 * std::tan(0.5 * w), dt = 1 + 0.25 * t * t;  // dt: derivative of t with w
  if (std::abs(w) < 1e-5) return radial(m, 1, 0, Eigen::RowVector4d::Zero());
  if (r < tiny_radius)
    return radial(m, t / w, -2.0 / 3 * t * t * t / w, Eigen::RowVector4d((dt * w - t) / (w * w), 0, 0, 0));
  const double angle = std::atan(r * t), bend = 1 + r * r * t * t;
  const double g = angle / (r * w);
  const double slope = t / (w * bend);  // of r·g
  const double to_w = (dt / bend - g) / w;
  return radial(m, g, (slope - g) / (r * r), Eigen::RowVector4d(to_w, 0, 0, 0));
}

}  // namespace

std::optional<Distorted> distort(Distortion distortion, const Coeffs& coeffs, const Vec2& m) {
  switch (distortion) {
    case Distortion::none:
      return Distorted{m, Eigen::Matrix2d::Identity()};
    case Distortion::radtan: {
      const Distorted out = radtan(coeffs, m);
      if (m.squaredNorm() >= radtan_fold(coeffs) || out.to_place.determinant() <= 0) return std::nullopt;
      return out;
    }
    case Distortion::equidistant: {
      const Distorted out = equidistant(coeffs, m);
      if (bent(coeffs, std::atan(m.norm())).second <= 0) return std::nullopt;
      return out;
    }
    case Distortion::fov:
      return fov(coeffs[0], m);
  }
  return std::nullopt;
}

std::optional<Vec2> undistort(Distortion distortion, const Coeffs& coeffs, const Vec2& d) {
  switch (distortion) {
    case Distortion::none:
      return d;
    case Distortion::radtan: {
      Vec2 m = d;
      for (int i = 0; i < 30; ++i) {
        const Distorted out = radtan(coeffs, m);
        if (out.to_place.determinant() <= 1e-6) return std::nullopt;
        const Vec2 step = out.to_place.inverse() * (d - out.place);
        m += step;
        if (step.squaredNorm() < 1e-24) return m;
      }
      return std::nullopt;
    }
    case Distortion::equidistant: {
      const double r = d.norm();
      if (r < 1e-12) return d;
      const auto theta = unbent(coeffs, r);
      if (!theta || *theta > 1.57) return std::nullopt;
      return Vec2(std::tan(*theta) / r * d);
    }
    case Distortion::fov: {
      const double w = coeffs[0], r = d.norm();
      if (std::abs(w) < 1e-5 || r < 1e-12) return d;
      if (r * std::abs(w) > 1.57) return std::nullopt;
      return Vec2(std::tan(r * w) / (2 * r * std::tan(0.5 * w)) * d);
    }
  }
  return std::nullopt;
}

std::optional<Fisheye> fisheye(const Coeffs& coeffs, const Vec3& p) {
  const double rho = std::hypot(p.x(), p.y()), d2 = p.squaredNorm();
  const double theta = std::atan2(rho, p.z());
  const auto [r, slope] = bent(coeffs, theta);
  if (slope <= 0 || !(d2 > 0) || !std::isfinite(d2)) return std::nullopt;
  Fisheye out;
  const double near = 1e-9 * std::sqrt(d2);
  if (rho < near) {
    if (p.z() <= 0) return std::nullopt;  // straight behind: in no direction
    out.place = p.head<2>() / p.z();
    out.to_point << 1 / p.z(), 0, -out.place.x() / p.z(), 0, 1 / p.z(), -out.place.y() / p.z();
    out.to_coeffs.setZero();
    return out;
  }
  const Vec2 u = p.head<2>() / rho;
  out.place = r * u;
  // Along u the angle grows, across it u turns.
  out.to_point.leftCols<2>() =
      slope * p.z() / d2 * u * u.transpose() + r / rho * (Eigen::Matrix2d::Identity() - u * u.transpose());
  out.to_point.col(2) = -slope * rho / d2 * u;
  out.to_coeffs = u * bent_to_coeffs(theta);
  return out;
}

std::optional<Vec3> from_fisheye(const Coeffs& coeffs, const Vec2& d) {
  const double r = d.norm();
  if (r < 1e-12) return Vec3(0, 0, 1);
  const auto theta = unbent(coeffs, r);
  if (!theta) return std::nullopt;
  const double s = std::sin(*theta) / r;
  return Vec3(s * d.x(), s * d.y(), std::cos(*theta));
}

}  // namespace takt::lens
