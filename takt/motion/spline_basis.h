// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

/// Uniform B-splines of any order (degree + 1): which control points act at a time, and with what weight.
/// Derivation and conventions: docs/methods/splines.md.
namespace takt {

template <int Order>
using BasisMatrix = std::array<std::array<double, Order>, Order>;

namespace detail {
constexpr double binomial(int n, int k) {
  double b = 1;
  for (int i = 1; i <= k; ++i) b = b * (n - k + i) / i;
  return b;
}
constexpr double power(double x, int n) {
  double p = 1;
  for (int i = 0; i < n; ++i) p *= x;
  return p;
}
}  // namespace detail

/// Row s, column n: what u^n contributes to the weight of control point s of a segment, u in [0, 1]
/// (closed form of [Qin2000], as in [Sommer2020]).
template <int Order>
constexpr BasisMatrix<Order> uniform_basis() {
  constexpr int degree = Order - 1;
  double factorial = 1;
  for (int i = 2; i <= degree; ++i) factorial *= i;
  BasisMatrix<Order> m{};
  for (int s = 0; s < Order; ++s)
    for (int n = 0; n < Order; ++n) {
      double sum = 0;
      for (int l = s; l < Order; ++l)
        sum += ((l - s) % 2 ? -1 : 1) * detail::binomial(Order, l - s) * detail::power(degree - l, degree - n);
      m[s][n] = detail::binomial(degree, n) / factorial * sum;
    }
  return m;
}

/// Row j is the sum of the rows j, j + 1, … of uniform_basis: the weight of the step from control point j − 1 to j.
template <int Order>
constexpr BasisMatrix<Order> cumulative_basis() {
  BasisMatrix<Order> m = uniform_basis<Order>();
  for (int j = Order - 2; j >= 0; --j)
    for (int n = 0; n < Order; ++n) m[j][n] += m[j + 1][n];
  return m;
}

/// The weights of a segment's control points at one instant and their first and second time derivatives.
/// Derivatives that were not asked for are left unset.
template <int Order>
struct Weights {
  using Vector = Eigen::Matrix<double, Order, 1>;
  Vector value, d1, d2;
};

/// `u` in [0, 1] within a segment of `interval` seconds. Derivatives: how many are wanted, 0 to 2.
template <int Order, int Derivatives>
[[nodiscard]] Weights<Order> weights_at(const BasisMatrix<Order>& basis, double u, double interval) {
  Weights<Order> w;
  for (int s = 0; s < Order; ++s) {
    double value = 0, d1 = 0, d2 = 0;  // Horner, differentiated along
    for (int n = Order - 1; n >= 0; --n) {
      if constexpr (Derivatives > 1) d2 = d2 * u + 2 * d1;
      if constexpr (Derivatives > 0) d1 = d1 * u + value;
      value = value * u + basis[s][n];
    }
    w.value[s] = value;
    if constexpr (Derivatives > 0) w.d1[s] = d1 / interval;
    if constexpr (Derivatives > 1) w.d2[s] = d2 / (interval * interval);
  }
  return w;
}

/// Where an instant falls: the first of the Order control points that act, and how far into its segment.
struct KnotPlace {
  int first;
  double u;
};

/// Knots `interval` seconds apart. The spline is defined on [0, duration()] seconds, both ends included;
/// `count` control points make `count − Order + 1` segments.
template <int Order>
class UniformKnots {
  static_assert(3 <= Order && Order <= 6, "takt's splines are quadratic to quintic");

 public:
  /// Throws std::invalid_argument without a positive interval and at least Order control points.
  UniformKnots(double interval_s, int control_points) : interval_(interval_s), count_(control_points) {
    if (!(interval_s > 0) || !std::isfinite(interval_s) || control_points < Order)
      throw std::invalid_argument("UniformKnots: interval " + std::to_string(interval_s) + " s with " +
                                  std::to_string(control_points) + " control points; order " + std::to_string(Order) +
                                  " needs a positive interval and at least that many points");
  }
  /// The fewest control points that cover [0, duration_s] at an interval of at most `interval_s`; the last knot falls
  /// on `duration_s` exactly.
  [[nodiscard]] static UniformKnots covering(double duration_s, double interval_s) {
    if (!(duration_s > 0) || !(interval_s > 0) || duration_s / interval_s > 1e8)
      throw std::invalid_argument("UniformKnots: cannot cover " + std::to_string(duration_s) + " s at intervals of " +
                                  std::to_string(interval_s) + " s");
    const int segments = std::max(1, static_cast<int>(std::ceil(duration_s / interval_s - 1e-9)));
    return UniformKnots(duration_s / segments, segments + Order - 1);
  }

  [[nodiscard]] double interval_s() const { return interval_; }
  [[nodiscard]] int control_points() const { return count_; }
  [[nodiscard]] int segments() const { return count_ - Order + 1; }
  [[nodiscard]] double duration_s() const { return segments() * interval_; }
  [[nodiscard]] bool contains(double t) const { return t >= 0 && t <= duration_s(); }

  /// Throws std::out_of_range (a logic error) naming `t` and the valid range.
  [[nodiscard]] KnotPlace locate(double t) const {
    if (!contains(t)) throw_out_of_range(t);
    const double x = t / interval_;
    const int segment = std::min(static_cast<int>(x), segments() - 1);
    return {segment, x - segment};
  }

 private:
  [[noreturn]] void throw_out_of_range(double t) const {
    throw std::out_of_range("spline evaluated at " + std::to_string(t) + " s, outside its range of 0 to " +
                            std::to_string(duration_s()) + " s");
  }

  double interval_;
  int count_;
};

}  // namespace takt
