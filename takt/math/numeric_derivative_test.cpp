// SPDX-License-Identifier: Apache-2.0
#include "takt/math/numeric_derivative.h"

#include <gtest/gtest.h>

#include "takt/math/check_derivative.h"

namespace takt {
namespace {

// f(x, y) = (x²·y, exp(x) + sin(3y), 7x) at (0.4, -1.1)
const Eigen::Vector2d at(0.4, -1.1);
Eigen::VectorXd f(const Eigen::VectorXd& delta) {
  const Eigen::Vector2d p = at + delta;
  return Eigen::Vector3d(p.x() * p.x() * p.y(), std::exp(p.x()) + std::sin(3 * p.y()), 7 * p.x());
}
Eigen::MatrixXd jacobian() {
  Eigen::MatrixXd j(3, 2);
  j << 2 * at.x() * at.y(), at.x() * at.x(), std::exp(at.x()), 3 * std::cos(3 * at.y()), 7, 0;
  return j;
}

TEST(NumericDerivative, IsCloseToTheTruthAndKnowsHowClose) {
  const NumericJacobian numeric = numeric_jacobian(f, 2);
  const Eigen::MatrixXd off = (numeric.value - jacobian()).cwiseAbs();
  EXPECT_LT(off.maxCoeff(), 1e-11);
  // The bound covers the error, rounding of the bound itself aside.
  EXPECT_LT((off - numeric.error).maxCoeff(), 1e-12);
}

TEST(NumericDerivative, TheCheckerAcceptsTheRightJacobian) {
  EXPECT_TRUE(is_derivative(jacobian(), f));
}

TEST(NumericDerivative, TheCheckerNamesTheWrongEntry) {
  Eigen::MatrixXd wrong = jacobian();
  wrong(1, 1) += 1e-6;
  const testing::AssertionResult result = is_derivative(wrong, f);
  EXPECT_FALSE(result);
  EXPECT_NE(std::string(result.message()).find("(1, 1)"), std::string::npos) << result.message();
}

TEST(NumericDerivative, TheCheckerRefusesNanAndWrongShape) {
  Eigen::MatrixXd wrong = jacobian();
  wrong(0, 0) = NAN;
  EXPECT_FALSE(is_derivative(wrong, f));
  EXPECT_FALSE(is_derivative(Eigen::MatrixXd(Eigen::MatrixXd::Zero(2, 2)), f));
}

TEST(NumericDerivative, TheCheckerRefusesAFunctionWithoutDerivative) {
  const auto kink = [](const Eigen::VectorXd& d) { return Eigen::VectorXd::Constant(1, std::cbrt(d[0])); };
  EXPECT_FALSE(is_derivative(Eigen::MatrixXd::Constant(1, 1, 1.0), kink));
}

}  // namespace
}  // namespace takt
