// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/motion/spline_basis.h"

namespace takt {

/// A curve of orientations R_world_body(t): a uniform cumulative B-spline on SO(3) of order 3 to 6,
///   R(t) = R_i · Exp(λ_1 d_1) ⋯ Exp(λ_{k−1} d_{k−1}),   d_j = Log(R_{i+j−1}ᵀ R_{i+j}),
/// with the O(order) recursion of [Sommer2020] for its derivatives. Neighbouring control points should be less than
/// half a turn apart. Time is in seconds from the spline's start, 0 to duration_s().
template <int Order>
class RotationSpline {
 public:
  /// At one instant, in the body's frame: Ṙ = R·hat(velocity).
  struct Motion {
    Quat rotation;
    Vec3 velocity;      ///< rad/s
    Vec3 acceleration;  ///< rad/s²
    int first;          ///< the first of the Order control points that act here
  };
  /// To each acting control point under R_i ← R_i·Exp(δ): R ← R·Exp(rotation[i]·δ),
  /// velocity += velocity[i]·δ, acceleration += acceleration[i]·δ.
  struct Jacobians {
    std::array<Mat3, Order> rotation, velocity, acceleration;
  };

  RotationSpline(double interval_s, std::vector<Quat> control_points);

  /// Derivatives: how many time derivatives are wanted (0 to 2); the others, and their Jacobians, are left unset.
  /// Throws std::out_of_range outside [0, duration_s()]. No allocation.
  template <int Derivatives = 2>
  [[nodiscard]] Motion evaluate(double t) const;
  template <int Derivatives = 2>
  [[nodiscard]] Motion evaluate(double t, Jacobians& jacobians) const;
  [[nodiscard]] Quat operator()(double t) const { return evaluate<0>(t).rotation; }

  [[nodiscard]] const UniformKnots<Order>& knots() const { return knots_; }
  [[nodiscard]] double duration_s() const { return knots_.duration_s(); }
  [[nodiscard]] const std::vector<Quat>& control_points() const { return points_; }
  /// Moves control points i, each to R_i·Exp(delta_i): one step of an optimiser. `deltas` (rad) has one a column.
  void retract(const Eigen::Matrix3Xd& deltas);

 private:
  /// From one control point to the next; depends on the control points only, so it is shared by all instants between.
  struct Step {
    Vec3 d;
    Mat3 inverse_jacobian;  ///< right_jacobian_inverse(d)
  };
  void update_steps();
  template <int Derivatives, bool WithJacobians>
  Motion evaluate_impl(double t, Jacobians* jacobians) const;

  UniformKnots<Order> knots_;
  std::vector<Quat> points_;
  std::vector<Step> steps_;
};

extern template class RotationSpline<3>;
extern template class RotationSpline<4>;
extern template class RotationSpline<5>;
extern template class RotationSpline<6>;

}  // namespace takt
