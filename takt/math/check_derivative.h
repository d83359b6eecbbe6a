// SPDX-License-Identifier: Apache-2.0
#pragma once
// For tests only: the one checker of all Jacobians.
#include <gtest/gtest.h>

#include <sstream>

#include "takt/math/numeric_derivative.h"

namespace takt {

/// Whether `analytic` is the derivative of `f` (a function of a perturbation, see numeric_jacobian) at 0.
/// An entry fails when it is further off than `tolerance` times the largest entry of its own matrix (at least 1), plus
/// what the numeric derivative itself may be off. A numeric derivative too rough to judge fails as well.
template <class Derived, class Function>
[[nodiscard]] testing::AssertionResult is_derivative(const Eigen::MatrixBase<Derived>& analytic, const Function& f,
                                                     double tolerance = 1e-8, double step = 1e-2) {
  const NumericJacobian numeric = numeric_jacobian(f, static_cast<int>(analytic.cols()), step);
  if (numeric.value.rows() != analytic.rows())
    return testing::AssertionFailure() << "the function has " << numeric.value.rows() << " values, the Jacobian "
                                       << analytic.rows() << " rows";
  const double scale = std::max(1.0, numeric.value.cwiseAbs().maxCoeff());
  const Eigen::MatrixXd off = (analytic - numeric.value).cwiseAbs();
  Eigen::Index row = 0, column = 0;
  const double worst = off.hasNaN() ? NAN : (off - numeric.error.cwiseMin(tolerance * scale)).maxCoeff(&row, &column);
  const bool judged = numeric.error.maxCoeff() <= tolerance * scale;
  if (worst <= tolerance * scale && judged) return testing::AssertionSuccess();
  const Eigen::IOFormat format(10, 0, "  ", "\n", "    ", "");
  std::ostringstream text;
  text << (judged ? "worst entry (" : "the numeric derivative is too rough to judge; worst entry (") << row << ", "
       << column << "): analytic " << analytic(row, column) << ", numeric " << numeric.value(row, column) << " +- "
       << numeric.error(row, column) << ", allowed " << tolerance * scale << "\n  analytic\n"
       << Eigen::MatrixXd(analytic).format(format) << "\n  numeric\n"
       << numeric.value.format(format);
  return testing::AssertionFailure() << text.str();
}

}  // namespace takt
