// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/preintegration.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace takt {

namespace {

/// Exp(φ)·a for a small φ, to third order.
Vec3 turned(const Vec3& phi, const Vec3& a) {
  const Vec3 once = phi.cross(a), twice = phi.cross(once);
  return a + once + 0.5 * twice + phi.cross(twice) / 6;
}

/// The integral over one piece of a sample interval, in the body's frame at its start. Two Gauss–Legendre nodes.
struct Piece {
  Piece(const ImuCurve& curve, std::size_t interval, double t0, double t1, const Vec3& gyro_bias,
        const Vec3& accel_bias) {
    h = t1 - t0;
    const double root = std::sqrt(1.0 / 3);
    const double s[2] = {0.5 * h * (1 - root), 0.5 * h * (1 + root)};
    Vec3 w[2], a[2];
    for (int i = 0; i < 2; ++i) {
      const ImuCurve::Reading r = curve.in(interval, t0 + s[i]);
      w[i] = r.gyro - gyro_bias;
      a[i] = r.accel - accel_bias;
    }
    // Magnus to fourth order.
    const double commutator = h * h * root / 4;
    turn = 0.5 * h * (w[0] + w[1]) + commutator * w[0].cross(w[1]);
    turn_to_gyro = commutator * hat(w[1] - w[0]) - h * Mat3::Identity();
    const Vec3 slope = (w[1] - w[0]) / (s[1] - s[0]);
    for (int i = 0; i < 2; ++i) {
      const Vec3 phi = s[i] * (w[0] + (0.5 * s[i] - s[0]) * slope);  // ∫ω up to the node
      const Mat3 half_turn = 0.5 * hat(phi);
      const Vec3 force = 0.5 * h * turned(phi, a[i]);
      const Mat3 to_gyro = s[i] * (hat(force) + hat(force) * half_turn);
      const Mat3 to_accel = -0.5 * h * (Mat3::Identity() + 2 * half_turn + 2 * half_turn * half_turn);
      velocity += force;
      position += (h - s[i]) * force;
      velocity_to_gyro += to_gyro;
      position_to_gyro += (h - s[i]) * to_gyro;
      velocity_to_accel += to_accel;
      position_to_accel += (h - s[i]) * to_accel;
    }
  }

  double h;
  Vec3 turn;  ///< rotation vector of the whole piece
  Mat3 turn_to_gyro;
  Vec3 velocity = Vec3::Zero(), position = Vec3::Zero();
  Mat3 velocity_to_gyro = Mat3::Zero(), velocity_to_accel = Mat3::Zero();
  Mat3 position_to_gyro = Mat3::Zero(), position_to_accel = Mat3::Zero();
};

/// Blocks of the covariance of (δ, Δv, Δp). That of δ stays a multiple of the identity.
struct Covariance {
  double rotation = 0;
  Mat3 vr = Mat3::Zero(), pr = Mat3::Zero(), vv = Mat3::Zero(), pv = Mat3::Zero(), pp = Mat3::Zero();

  /// v_to_r, p_to_r: how an error of the rotation before the piece enters velocity and position after it.
  void advance(double h, const Mat3& v_to_r, const Mat3& p_to_r, const Mat3& turn, const ImuDensity& noise) {
    const Mat3 v_r = vr + rotation * v_to_r;  // with the rotation before the piece
    const Mat3 p_r = pr + h * vr + rotation * p_to_r;
    const Mat3 p_v = pv + h * vv + p_to_r * vr.transpose();              // with the velocity before the piece
    const Mat3 p_p = pp + h * pv.transpose() + p_to_r * pr.transpose();  // with the position before
    pp = p_p + h * p_v + p_r * p_to_r.transpose();
    pv = p_v + p_r * v_to_r.transpose();
    vv = vv + v_to_r * vr.transpose() + v_r * v_to_r.transpose();
    vr = v_r * turn;
    pr = p_r * turn;
    rotation += noise.gyro * noise.gyro * h;
    const double q = noise.accel * noise.accel * h;
    vv.diagonal().array() += q;
    pv.diagonal().array() += q * h / 2;
    pp.diagonal().array() += q * h * h / 3;
  }
  [[nodiscard]] Mat9 matrix() const {
    Mat9 m;
    m << rotation * Mat3::Identity(), vr.transpose(), pr.transpose(), vr, vv, pv.transpose(), pr, pv, pp;
    return m;
  }
};

}  // namespace

Preintegrated preintegrate(const ImuCurve& curve, double t0, double t1, const Vec3& gyro_bias, const Vec3& accel_bias,
                           const ImuDensity& noise) {
  if (!curve.covers(t0, t1))
    throw std::invalid_argument("preintegrate: [" + std::to_string(t0) + ", " + std::to_string(t1) +
                                "] is not covered by the samples");
  const std::span<const double> t = curve.times_s();
  Preintegrated out;
  out.duration_s = t1 - t0;
  Covariance covariance;
  std::size_t j = curve.interval(t0);
  for (double from = t0; from < t1; ++j) {
    const double to = std::min(t[j + 1], t1);
    const Piece piece(curve, j, from, to, gyro_bias, accel_bias);
    const double h = piece.h;
    const Mat3 R = out.rotation.toRotationMatrix();
    const ExpAndJacobian turn = exp_and_jacobian(piece.turn);
    const Mat3 E = turn.rotation.toRotationMatrix();
    const Mat3 v_to_r = -R * hat(piece.velocity), p_to_r = -R * hat(piece.position);

    out.position_to_gyro += h * out.velocity_to_gyro + p_to_r * out.rotation_to_gyro + R * piece.position_to_gyro;
    out.velocity_to_gyro += v_to_r * out.rotation_to_gyro + R * piece.velocity_to_gyro;
    out.position_to_accel += h * out.velocity_to_accel + R * piece.position_to_accel;
    out.velocity_to_accel += R * piece.velocity_to_accel;
    out.rotation_to_gyro = E.transpose() * out.rotation_to_gyro + turn.right_jacobian * piece.turn_to_gyro;
    covariance.advance(h, v_to_r, p_to_r, E, noise);

    out.position += h * out.velocity + R * piece.position;
    out.velocity += R * piece.velocity;
    out.rotation = (out.rotation * turn.rotation).normalized();
    from = to;
  }
  out.covariance = covariance.matrix();

  const ImuCurve::Reading first = curve.at(t0), last = curve.at(t1);
  const Vec3 w0 = first.gyro - gyro_bias, a0 = first.accel - accel_bias;
  const Vec3 w1 = last.gyro - gyro_bias, a1 = last.accel - accel_bias;
  out.to_start = {-(out.rotation.conjugate() * w0), -a0 - w0.cross(out.velocity),
                  -out.duration_s * a0 - w0.cross(out.position)};
  out.to_end = {w1, out.rotation * a1, out.velocity};
  return out;
}

}  // namespace takt
