// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "takt/math/banded.h"
#include "takt/motion/spline.h"

namespace takt {

/// Over one segment of unit length: entry (a, b) is ∫ b_a''(u)·b_b''(u) du of the basis functions a and b.
template <int Order>
[[nodiscard]] Eigen::Matrix<double, Order, Order> roughness_of_basis() {
  constexpr BasisMatrix<Order> basis = uniform_basis<Order>();
  Eigen::Matrix<double, Order, Order> gram = Eigen::Matrix<double, Order, Order>::Zero();
  for (int a = 0; a < Order; ++a)
    for (int b = 0; b < Order; ++b)
      for (int i = 2; i < Order; ++i)
        for (int j = 2; j < Order; ++j)
          gram(a, b) += i * (i - 1) * basis[a][i] * j * (j - 1) * basis[b][j] / (i + j - 3);
  return gram;
}

template <int Dim, int Order>
struct SplineFit {
  EuclideanSpline<Dim, Order> spline;
  double rms = 0;              ///< weighted root mean square of the residuals, over samples and coordinates
  BandedCholesky information;  ///< of the control points, one coordinate; in the unit that the weights give

  /// Variance of one coordinate's value at `t` where the weights are 1/σ² of the samples (else in units of σ²).
  [[nodiscard]] double variance(double t) const {
    const auto at = spline.template evaluate<0>(t);
    Eigen::VectorXd f = Eigen::VectorXd::Zero(information.size());
    f.template segment<Order>(at.first) = at.weights.value;
    return information.variance(f);
  }
};

/// The spline s over `knots` that minimises Σ w_i·|y_i − s(t_i)|² + roughness·∫|s''|² dt, in O(samples + knots).
/// `times` in seconds within the knots, in any order; `values` one a column; `weights` empty (all 1) or one a sample.
/// A roughness > 0 also carries the curve across gaps, as straight as it can.
/// Throws std::invalid_argument when sizes disagree or the samples leave a control point undetermined (naming where),
/// std::out_of_range for a time outside the knots.
template <int Dim, int Order>
[[nodiscard]] SplineFit<Dim, Order> fit_spline(std::span<const double> times,
                                               const Eigen::Matrix<double, Dim, Eigen::Dynamic>& values,
                                               const UniformKnots<Order>& knots, double roughness = 0,
                                               std::span<const double> weights = {}) {
  using Points = typename EuclideanSpline<Dim, Order>::Points;
  const auto count = static_cast<Eigen::Index>(times.size());
  if (values.cols() != count || (!weights.empty() && weights.size() != times.size()))
    throw std::invalid_argument("fit_spline: " + std::to_string(count) + " times, " + std::to_string(values.cols()) +
                                " values, " + std::to_string(weights.size()) + " weights");
  constexpr BasisMatrix<Order> basis = uniform_basis<Order>();
  const int n = knots.control_points();
  const double h = knots.interval_s();

  BandedMatrix normal(n, Order - 1);
  Eigen::Matrix<double, Eigen::Dynamic, Dim> right = Eigen::Matrix<double, Eigen::Dynamic, Dim>::Zero(n, Dim);
  for (Eigen::Index i = 0; i < count; ++i) {
    const KnotPlace place = knots.locate(times[i]);
    const auto b = weights_at<Order, 0>(basis, place.u, h).value;
    const double w = weights.empty() ? 1 : weights[i];
    for (int c = 0; c < Order; ++c) normal.column(place.first + c).head(Order - c) += w * b[c] * b.tail(Order - c);
    right.template middleRows<Order>(place.first) += w * b * values.col(i).transpose();
  }
  if (roughness > 0) {
    const Eigen::MatrixXd gram = roughness / (h * h * h) * roughness_of_basis<Order>();
    for (int segment = 0; segment < knots.segments(); ++segment) normal.add_block(segment, gram);
  }

  BandedCholesky factor(std::move(normal));
  if (!factor.ok())
    throw std::invalid_argument("fit_spline: too few samples near " +
                                std::to_string((factor.failed_pivot() - 0.5 * (Order - 2)) * h) +
                                " s to determine the spline there; use a longer knot interval or a roughness > 0");
  EuclideanSpline<Dim, Order> spline(h, Points(factor.solve(right).transpose()));
  double sum = 0;
  for (Eigen::Index i = 0; i < count; ++i)
    sum += (weights.empty() ? 1 : weights[i]) * (values.col(i) - spline(times[i])).squaredNorm();
  return {std::move(spline), count > 0 ? std::sqrt(sum / (static_cast<double>(count) * Dim)) : 0, std::move(factor)};
}

}  // namespace takt
