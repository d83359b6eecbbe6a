// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/rotation_spline.h"

#include <stdexcept>

namespace takt {

template <int Order>
RotationSpline<Order>::RotationSpline(double interval_s, std::vector<Quat> control_points)
    : knots_(interval_s, static_cast<int>(control_points.size())), points_(std::move(control_points)) {
  for (Quat& q : points_) q.normalize();
  update_steps();
}

template <int Order>
void RotationSpline<Order>::retract(const Eigen::Matrix3Xd& deltas) {
  if (deltas.cols() != knots_.control_points())
    throw std::invalid_argument("RotationSpline::retract: " + std::to_string(deltas.cols()) + " steps for " +
                                std::to_string(knots_.control_points()) + " control points");
  for (Eigen::Index i = 0; i < deltas.cols(); ++i) points_[i] = (points_[i] * exp_so3(deltas.col(i))).normalized();
  update_steps();
}

template <int Order>
void RotationSpline<Order>::update_steps() {
  steps_.resize(points_.size() - 1);
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Vec3 d = log_so3(points_[i].conjugate() * points_[i + 1]);
    steps_[i] = {d, right_jacobian_inverse(d)};
  }
}

template <int Order>
template <int Derivatives, bool WithJacobians>
auto RotationSpline<Order>::evaluate_impl(double t, Jacobians* jacobians) const -> Motion {
  static constexpr BasisMatrix<Order> basis = cumulative_basis<Order>();
  constexpr int last = Order - 1;
  const KnotPlace place = knots_.locate(t);
  const Weights<Order> w = weights_at<Order, Derivatives>(basis, place.u, knots_.interval_s());
  const auto step = [&](int j) -> const Step& { return steps_[place.first + j - 1]; };  // from point j − 1 to j

  Motion m;
  m.first = place.first;
  m.rotation = points_[place.first];
  m.velocity.setZero();
  m.acceleration.setZero();
  std::array<Mat3, Order> back;      // A_jᵀ: from the frame after step j − 1 to the one after step j
  std::array<Mat3, Order> velocity;  // ∂(velocity after step j)/∂d_j, and so on
  std::array<Mat3, Order> acceleration;
  std::array<Mat3, Order> turn;  // ∂(rotation after step j)/∂d_j
  for (int j = 1; j <= last; ++j) {
    const Vec3& d = step(j).d;
    const Vec3 phi = w.value[j] * d;
    Quat a;
    if constexpr (WithJacobians) {
      const ExpAndJacobian both = exp_and_jacobian(phi);
      a = both.rotation;
      turn[j] = w.value[j] * both.right_jacobian;
    } else {
      a = exp_so3(phi);
    }
    m.rotation = m.rotation * a;
    if constexpr (Derivatives == 0 && !WithJacobians) continue;
    back[j] = a.toRotationMatrix().transpose();
    if constexpr (Derivatives > 0) {
      m.velocity = back[j] * m.velocity;
      if constexpr (WithJacobians) {
        velocity[j] = hat(m.velocity) * turn[j];
        velocity[j].diagonal().array() += w.d1[j];
      }
      m.velocity += w.d1[j] * d;
    }
    if constexpr (Derivatives > 1) {
      m.acceleration = back[j] * m.acceleration;
      if constexpr (WithJacobians) {
        acceleration[j] = hat(m.acceleration) * turn[j] + w.d1[j] * (hat(m.velocity) - hat(d) * velocity[j]);
        acceleration[j].diagonal().array() += w.d2[j];
      }
      m.acceleration += w.d1[j] * m.velocity.cross(d) + w.d2[j] * d;
    }
  }

  if constexpr (WithJacobians) {
    // From the last step to the first: `carry` takes a change after step j to the end, `couple` a change of the
    // velocity after step j to the acceleration at the end.
    Mat3 carry = Mat3::Identity(), couple = Mat3::Zero();
    jacobians->rotation[last].setZero();
    if constexpr (Derivatives > 0) jacobians->velocity[last].setZero();
    if constexpr (Derivatives > 1) jacobians->acceleration[last].setZero();
    for (int j = last; j >= 1; --j) {
      // ∂d_j/∂δ_j = Jr⁻¹(d_j), ∂d_j/∂δ_{j−1} = −Jl⁻¹(d_j) = −Jr⁻¹(d_j)ᵀ.
      const Mat3 ahead = step(j).inverse_jacobian, behind = -ahead.transpose();
      const auto spread = [&](std::array<Mat3, Order>& to, const Mat3& by_step) {
        to[j].noalias() += by_step * ahead;
        to[j - 1].noalias() = by_step * behind;
      };
      spread(jacobians->rotation, carry * turn[j]);
      if constexpr (Derivatives > 0) spread(jacobians->velocity, carry * velocity[j]);
      if constexpr (Derivatives > 1) {
        spread(jacobians->acceleration, carry * acceleration[j] + couple * velocity[j]);
        couple = (couple - w.d1[j] * carry * hat(step(j).d)) * back[j];
      }
      carry = carry * back[j];
    }
    jacobians->rotation[0] += carry;
  }
  return m;
}

template <int Order>
template <int Derivatives>
auto RotationSpline<Order>::evaluate(double t) const -> Motion {
  return evaluate_impl<Derivatives, false>(t, nullptr);
}

template <int Order>
template <int Derivatives>
auto RotationSpline<Order>::evaluate(double t, Jacobians& jacobians) const -> Motion {
  return evaluate_impl<Derivatives, true>(t, &jacobians);
}

#define TAKT_INSTANTIATE(ORDER, DERIVATIVES)                                                         \
  template RotationSpline<ORDER>::Motion RotationSpline<ORDER>::evaluate<DERIVATIVES>(double) const; \
  template RotationSpline<ORDER>::Motion RotationSpline<ORDER>::evaluate<DERIVATIVES>(double, Jacobians&) const;
#define TAKT_INSTANTIATE_ORDER(ORDER)   \
  template class RotationSpline<ORDER>; \
  TAKT_INSTANTIATE(ORDER, 0)            \
  TAKT_INSTANTIATE(ORDER, 1)            \
  TAKT_INSTANTIATE(ORDER, 2)
TAKT_INSTANTIATE_ORDER(3)
TAKT_INSTANTIATE_ORDER(4)
TAKT_INSTANTIATE_ORDER(5)
TAKT_INSTANTIATE_ORDER(6)
#undef TAKT_INSTANTIATE_ORDER
#undef TAKT_INSTANTIATE

}  // namespace takt
