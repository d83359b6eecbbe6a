// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/rotation.h"

#include <Eigen/SVD>
#include <cmath>
#include <numbers>

namespace takt {

namespace {
/// Below this angle the closed forms lose digits to cancellation and the series is exact to rounding.
constexpr double small_angle = 1e-2;

/// I + p·hat(φ) + q·hat(φ)², with hat(φ)² = φφᵀ − |φ|²·I.
Mat3 polynomial_in_hat(const Vec3& phi, double squared_norm, double p, double q) {
  const Vec3 px = p * phi, qx = q * phi;
  const double diagonal = 1 - q * squared_norm;
  const double xy = qx.x() * phi.y(), xz = qx.x() * phi.z(), yz = qx.y() * phi.z();
  Mat3 m;
  m << diagonal + qx.x() * phi.x(), xy - px.z(), xz + px.y(),  //
      xy + px.z(), diagonal + qx.y() * phi.y(), yz - px.x(),   //
      xz - px.y(), yz + px.x(), diagonal + qx.z() * phi.z();
  return m;
}

/// What the exponential and its right Jacobian share.
struct HalfAngle {
  explicit HalfAngle(const Vec3& phi) : angle(phi.norm()), cosine(std::cos(0.5 * angle)) {
    const double h2 = 0.25 * angle * angle;
    sine_over_angle =
        angle < small_angle ? 0.5 * (1 - h2 / 6 * (1 - h2 / 20 * (1 - h2 / 42))) : std::sin(0.5 * angle) / angle;
  }
  [[nodiscard]] Quat rotation(const Vec3& phi) const {
    const Vec3 v = sine_over_angle * phi;
    return {cosine, v.x(), v.y(), v.z()};
  }
  /// I − (1 − cos a)/a²·hat(φ) + (a − sin a)/a³·hat(φ)², by 1 − cos a = 2 sin²(a/2) and sin a = 2 sin(a/2)·cos(a/2).
  [[nodiscard]] Mat3 right_jacobian(const Vec3& phi) const {
    const double a2 = angle * angle;
    const double b = 2 * sine_over_angle * sine_over_angle;
    const double c = angle < small_angle ? 1.0 / 6 - a2 / 120 * (1 - a2 / 42) : (1 - 2 * sine_over_angle * cosine) / a2;
    return polynomial_in_hat(phi, a2, -b, c);
  }

  double angle, cosine, sine_over_angle;
};
}  // namespace

Mat3 hat(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

Quat exp_so3(const Vec3& phi) {
  return HalfAngle(phi).rotation(phi);
}

Vec3 log_so3(const Quat& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double n = q.vec().norm();
  const double w = std::abs(q.w());
  if (n < 1e-9 * w) return 2 * sign / w * q.vec();
  return 2 * sign * std::atan2(n, w) / n * q.vec();
}

Mat3 right_jacobian(const Vec3& phi) {
  return HalfAngle(phi).right_jacobian(phi);
}

ExpAndJacobian exp_and_jacobian(const Vec3& phi) {
  const HalfAngle half(phi);
  return {half.rotation(phi), half.right_jacobian(phi)};
}

Mat3 right_jacobian_inverse(const Vec3& phi) {
  const double a = phi.norm(), a2 = a * a;
  // cot(a/2), not (1 + cos a)/sin a, which is 0/0 at π.
  const double c = a < small_angle ? 1.0 / 12 + a2 / 720 * (1 + a2 / 42) : 1 / a2 - 1 / (2 * a * std::tan(0.5 * a));
  return polynomial_in_hat(phi, a2, 0.5, c);
}

VectorAlignment align_vectors(const Mat3& correlation) {
  const Eigen::JacobiSVD<Mat3> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 u = svd.matrixU(), v = svd.matrixV();
  const Vec3 signs(1, 1, (u * v.transpose()).determinant() < 0 ? -1 : 1);
  const Vec3 s = svd.singularValues();
  return {u * signs.asDiagonal() * v.transpose(), s[0] > 0 ? s[1] / s[0] : 0};
}

VectorAlignment align_vectors(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return align_vectors(Mat3(b * a.transpose()));
}

}  // namespace takt
