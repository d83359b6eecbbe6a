// SPDX-License-Identifier: Apache-2.0
#include "takt/math/banded.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace takt {
namespace {

struct Shape {
  int size, bandwidth;
};
/// From diagonal to full, with a band wider than the matrix too.
const Shape shapes[] = {{1, 0}, {5, 0}, {7, 1}, {30, 5}, {12, 11}, {4, 6}};

/// Σ of random rank-one blocks along the diagonal: positive definite, banded.
BandedMatrix random_positive(Shape shape) {
  BandedMatrix a(shape.size, shape.bandwidth);
  const int n = std::min(shape.size, shape.bandwidth + 1);
  for (int repeat = 0; repeat < 3; ++repeat)
    for (int first = 0; first + n <= shape.size; ++first) {
      const Eigen::VectorXd v = Eigen::VectorXd::Random(n);
      a.add_block(first, v * v.transpose() + 0.05 * Eigen::MatrixXd::Identity(n, n));
    }
  return a;
}

TEST(Banded, SolvesAsDenseDoes) {
  for (const Shape& shape : shapes) {
    const BandedMatrix a = random_positive(shape);
    const BandedCholesky factor(a);
    ASSERT_TRUE(factor.ok());
    const Eigen::MatrixXd b = Eigen::MatrixXd::Random(shape.size, 3);
    EXPECT_LT((a.dense() * factor.solve(b) - b).cwiseAbs().maxCoeff(), 1e-11) << shape.size;
    EXPECT_LT((factor.solve(b) - a.dense().llt().solve(b)).cwiseAbs().maxCoeff(), 1e-10) << shape.size;
    EXPECT_NEAR(factor.log_determinant(), std::log(a.dense().determinant()), 1e-10 * shape.size);
  }
}

TEST(Banded, SelectedInverseIsTheInverseWithinTheBand) {
  for (const Shape& shape : shapes) {
    const BandedMatrix a = random_positive(shape);
    const BandedMatrix z = BandedCholesky(a).selected_inverse();
    const Eigen::MatrixXd inverse = a.dense().inverse();
    const double scale = inverse.cwiseAbs().maxCoeff();
    for (int j = 0; j < shape.size; ++j)
      for (int i = j; i < shape.size && i <= j + shape.bandwidth; ++i)
        EXPECT_NEAR(z(i, j), inverse(i, j), 1e-11 * scale) << i << ", " << j << " of " << shape.size;
  }
}

TEST(Banded, VariancesAgreeWithTheDenseInverse) {
  const BandedMatrix a = random_positive({30, 5});
  const BandedCholesky factor(a);
  const Eigen::MatrixXd inverse = a.dense().inverse();
  const Eigen::VectorXd part = Eigen::VectorXd::Random(6);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(30);
  for (int first : {0, 11, 24}) {
    f.setZero();
    f.segment(first, 6) = part;
    const double expected = f.dot(inverse * f);
    EXPECT_NEAR(factor.variance(f), expected, 1e-11 * expected);
    EXPECT_NEAR(factor.selected_inverse().quadratic_form(first, part), expected, 1e-11 * expected);
    EXPECT_NEAR(a.quadratic_form(first, part), f.dot(a.dense() * f), 1e-12);
  }
}

TEST(Banded, NamesTheVariableThatIsNotDetermined) {
  BandedMatrix a = random_positive({30, 2});
  for (int i = 17; i <= 19; ++i)
    for (int j = std::max(0, i - 2); j <= i; ++j) a(i, j) = 0;
  for (int i = 20; i <= 21; ++i)
    for (int j = i - 2; j <= 19; ++j) a(i, j) = 0;
  EXPECT_EQ(BandedCholesky(a).failed_pivot(), 17);
  // Two variables of which only the sum is seen, in numbers that do not cancel exactly.
  BandedMatrix sum(2, 1);
  for (int i = 0; i < 10; ++i) sum.add_block(0, 0.1 / 3 * Eigen::MatrixXd::Ones(2, 2));
  EXPECT_EQ(BandedCholesky(sum).failed_pivot(), 1);
}

TEST(Banded, GuardsItsShape) {
  BandedMatrix a(10, 2);
  EXPECT_THROW(a.add_block(0, Eigen::MatrixXd::Ones(4, 4)), std::invalid_argument);
  EXPECT_THROW(a.add_block(8, Eigen::MatrixXd::Ones(3, 3)), std::invalid_argument);
  EXPECT_THROW(a.add_block(-1, Eigen::MatrixXd::Ones(2, 2)), std::invalid_argument);
  EXPECT_THROW((void)a.quadratic_form(9, Eigen::Vector2d::Ones()), std::invalid_argument);
  EXPECT_THROW((void)BandedCholesky(random_positive({7, 1})).solve(Eigen::VectorXd::Ones(6)), std::invalid_argument);
  EXPECT_THROW(BandedMatrix(-1, 0), std::invalid_argument);
}

}  // namespace
}  // namespace takt
