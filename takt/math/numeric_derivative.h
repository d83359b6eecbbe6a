// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <limits>

namespace takt {

/// A derivative found by evaluating the function, and how far it may be off (one bound an entry).
struct NumericJacobian {
  Eigen::MatrixXd value;
  Eigen::MatrixXd error;
};

/// Central differences with Richardson extrapolation over shrinking steps [Ridders1982].
/// `f` maps a perturbation δ (dimension `inputs`, evaluated near δ = 0) to a vector. A manifold hides in `f`: perturb
/// by its retraction, and express the result in the tangent space at f(0). `step` is the largest |δ| tried; the
/// function should be smooth over it.
template <class Function>
[[nodiscard]] NumericJacobian numeric_jacobian(const Function& f, int inputs, double step = 1e-2) {
  constexpr int rows = 6;
  constexpr double shrink = 1.6, shrink2 = shrink * shrink;
  const auto difference = [&](int column, double h) -> Eigen::VectorXd {
    Eigen::VectorXd delta = Eigen::VectorXd::Zero(inputs);
    delta[column] = h;
    const Eigen::VectorXd above = f(delta);
    delta[column] = -h;
    const Eigen::VectorXd below = f(delta);
    return (above - below) / (2 * h);
  };
  NumericJacobian jacobian;
  for (int column = 0; column < inputs; ++column) {
    std::array<std::array<Eigen::VectorXd, rows>, rows> table;
    Eigen::VectorXd best, best_error;
    double h = step;
    for (int i = 0; i < rows; ++i, h /= shrink) {
      table[i][0] = difference(column, h);
      if (i == 0) {
        best = table[0][0];
        best_error = Eigen::VectorXd::Constant(best.size(), std::numeric_limits<double>::max());
      }
      double factor = shrink2;
      for (int j = 1; j <= i; ++j, factor *= shrink2) {
        table[i][j] = (table[i][j - 1] * factor - table[i - 1][j - 1]) / (factor - 1);
        for (Eigen::Index k = 0; k < best.size(); ++k) {
          const double error = std::max(std::abs(table[i][j][k] - table[i][j - 1][k]),
                                        std::abs(table[i][j][k] - table[i - 1][j - 1][k]));
          if (error < best_error[k]) {
            best_error[k] = error;
            best[k] = table[i][j][k];
          }
        }
      }
    }
    if (column == 0) {
      jacobian.value.resize(best.size(), inputs);
      jacobian.error.resize(best.size(), inputs);
    }
    jacobian.value.col(column) = best;
    jacobian.error.col(column) = best_error;
  }
  return jacobian;
}

}  // namespace takt
