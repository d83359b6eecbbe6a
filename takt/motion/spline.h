// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/motion/spline_basis.h"

namespace takt {

/// A curve in R^Dim: a uniform B-spline of the given order over control points `interval` seconds apart.
/// Time is in seconds from the spline's start, 0 to duration_s(). Linear in its control points, so the basis weights
/// are its Jacobians: ∂value/∂c_{first+i} = weights.value[i]·I, and so on for the derivatives.
template <int Dim, int Order>
class EuclideanSpline {
 public:
  using Vector = Eigen::Matrix<double, Dim, 1>;
  using Points = Eigen::Matrix<double, Dim, Eigen::Dynamic>;

  struct Point {
    Vector value, velocity, acceleration;
    int first;               ///< the first of the Order control points that act here
    Weights<Order> weights;  ///< of control points first … first + Order − 1
  };

  /// `control_points`: one a column.
  EuclideanSpline(double interval_s, Points control_points)
      : knots_(interval_s, static_cast<int>(control_points.cols())), points_(std::move(control_points)) {}

  /// Derivatives: how many time derivatives are wanted (0 to 2); the others are left unset.
  /// Throws std::out_of_range outside [0, duration_s()].
  template <int Derivatives = 2>
  [[nodiscard]] Point evaluate(double t) const {
    const KnotPlace place = knots_.locate(t);
    Point p;
    p.first = place.first;
    p.weights = weights_at<Order, Derivatives>(basis, place.u, knots_.interval_s());
    const auto active = points_.template middleCols<Order>(place.first);
    p.value = active * p.weights.value;
    if constexpr (Derivatives > 0) p.velocity = active * p.weights.d1;
    if constexpr (Derivatives > 1) p.acceleration = active * p.weights.d2;
    return p;
  }
  [[nodiscard]] Vector operator()(double t) const { return evaluate<0>(t).value; }

  [[nodiscard]] const UniformKnots<Order>& knots() const { return knots_; }
  [[nodiscard]] double duration_s() const { return knots_.duration_s(); }
  [[nodiscard]] const Points& control_points() const { return points_; }
  /// An optimiser may move control points; their number stays.
  [[nodiscard]] auto control_point(int i) { return points_.col(i); }

 private:
  static constexpr BasisMatrix<Order> basis = uniform_basis<Order>();
  UniformKnots<Order> knots_;
  Points points_;
};

}  // namespace takt
