// SPDX-License-Identifier: Apache-2.0
#include "takt/math/arrow_system.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <vector>

namespace takt {
namespace {

constexpr int band = 24, bandwidth = 5, border = 3;
using Block = ArrowSystem::Block;

/// Residuals like an estimator's: some neighbours out of order, with and without the border.
ArrowSystem random_system(Eigen::MatrixXd& h, Eigen::VectorXd& g) {
  ArrowSystem system(band, bandwidth, border);
  h = Eigen::MatrixXd::Zero(band + border, band + border);
  g = Eigen::VectorXd::Zero(band + border);
  for (int first = 0; first + 6 <= band; ++first) {
    for (const std::vector<Block>& blocks : {std::vector<Block>{{first, 2}, {band, 1}, {first + 4, 2}},
                                             {{first + 3, 3}, {first, 2}},
                                             {{band + 1, 2}, {first, 6}}}) {
      int n = 0;
      for (const Block& b : blocks) n += b.size;
      const Eigen::MatrixXd j = Eigen::MatrixXd::Random(4, n);
      const Eigen::VectorXd r = Eigen::VectorXd::Random(4);
      system.accumulate_residual(blocks, j, r);
      Eigen::MatrixXd full = Eigen::MatrixXd::Zero(4, band + border);
      int column = 0;
      for (const Block& b : blocks) {
        full.middleCols(b.first, b.size) = j.middleCols(column, b.size);
        column += b.size;
      }
      h += full.transpose() * full;
      g += full.transpose() * r;
    }
  }
  return system;
}

TEST(ArrowSystem, AccumulatesWhatDenseDoes) {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;
  const ArrowSystem system = random_system(h, g);
  EXPECT_LT((system.dense() - h).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((system.gradient() - g).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((system.diagonal() - h.diagonal()).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(ArrowSystem, SolvesAndWeighsAsDenseDoes) {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;
  const ArrowSystem system = random_system(h, g);
  const auto solution = system.solve();
  ASSERT_TRUE(solution.ok());
  const Eigen::MatrixXd inverse = h.inverse();
  EXPECT_LT((solution.step() + inverse * g).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_LT((solution.border_covariance() - inverse.bottomRightCorner(border, border)).cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::VectorXd f = Eigen::VectorXd::Random(band + border);
  EXPECT_NEAR(solution.variance(f), f.dot(inverse * f), 1e-10);
}

TEST(ArrowSystem, DampsByTheDiagonal) {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;
  const ArrowSystem system = random_system(h, g);
  h.diagonal() *= 1.3;
  EXPECT_LT((system.solve(0.3).step() + h.llt().solve(g)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ArrowSystem, WorksWithoutABorder) {
  ArrowSystem system(4, 1, 0);
  for (int i = 0; i < 3; ++i)
    system.accumulate_residual(std::vector<Block>{{i, 2}}, Eigen::MatrixXd::Random(3, 2), Eigen::Vector3d::Random());
  const auto solution = system.solve();
  ASSERT_TRUE(solution.ok());
  EXPECT_LT((system.dense() * solution.step() + system.gradient()).norm(), 1e-12);
}

// A border variable that the band can imitate is not determined, whatever the units it is measured in.
TEST(ArrowSystem, SaysWhenTheBorderIsNotDetermined) {
  for (double unit : {1.0, 1e-9, 1e9}) {
    ArrowSystem system(10, 0, 1);
    for (int repeat = 0; repeat < 7; ++repeat)
      for (int i = 0; i < 10; ++i)
        system.accumulate_residual(std::vector<Block>{{i, 1}, {10, 1}}, Eigen::RowVector2d(0.1, 0.3 * unit),
                                   Eigen::VectorXd::Ones(1));
    EXPECT_FALSE(system.solve().ok()) << unit;
    system.accumulate_residual(std::vector<Block>{{10, 1}}, Eigen::MatrixXd::Constant(1, 1, 0.3 * unit),
                               Eigen::VectorXd::Ones(1));
    EXPECT_TRUE(system.solve().ok()) << unit;
  }
  EXPECT_FALSE(ArrowSystem(2, 1, 1).solve().ok());
}

/// A chain whose residuals join neighbours, three to all and two to a half of it: as one system, and cut in the middle.
struct CutChain {
  CutChain() {
    for (int i = 0; i + 1 < n; ++i) {
      const Eigen::MatrixXd j = Eigen::MatrixXd::Random(3, 5);
      const Eigen::VectorXd r = Eigen::VectorXd::Random(3);
      whole.accumulate_residual(std::vector<Block>{{i, 2}, {n, 3}}, j, r);
      // The left half has 0 … 5 and the right one 7 … 12 as its own; 6 stands between them.
      const bool left = i < cut;
      const int at = left ? i : i - cut - 1;
      if (i + 1 == cut)
        halves[0].accumulate_residual(std::vector<Block>{{at, 1}, {cut + 3, 1}, {cut, 3}}, j, r);
      else if (i == cut)
        halves[1].accumulate_residual(std::vector<Block>{{cut + 3, 1}, {0, 1}, {cut, 3}}, j, r);
      else
        halves[left ? 0 : 1].accumulate_residual(std::vector<Block>{{at, 2}, {cut, 3}}, j, r);
    }
  }
  static constexpr int cut = 6, n = 2 * cut + 1;
  ArrowSystem whole{n, 1, 3};
  ArrowSystem halves[2] = {{cut, 1, 4}, {cut, 1, 4}};
};

TEST(ArrowSystem, StretchesGiveWhatTheWholeChainDoes) {
  CutChain chain;
  const auto expected = chain.whole.solve();
  ArrowSystem outer(1, 0, 3);
  std::vector<ArrowSystem::Elimination> parts;
  for (ArrowSystem& half : chain.halves) {
    parts.push_back(std::move(half).eliminate());
    ASSERT_TRUE(parts.back().ok());
    outer.accumulate(std::vector<Block>{{1, 3}, {0, 1}}, parts.back());
  }
  const auto solution = outer.solve();
  ASSERT_TRUE(solution.ok());
  EXPECT_NEAR(solution.log_determinant(), expected.log_determinant(), 1e-11);
  EXPECT_LT((solution.border_covariance() - expected.border_covariance()).cwiseAbs().maxCoeff(), 1e-10);
  const Eigen::VectorXd x = solution.step();
  const Eigen::Vector4d shared(x[1], x[2], x[3], x[0]);
  Eigen::VectorXd step(CutChain::n + 3);
  step << parts[0].band_step(shared), x[0], parts[1].band_step(shared), x.tail(3);
  EXPECT_LT((step - expected.step()).cwiseAbs().maxCoeff(), 1e-10);
}

// What the stretches can imitate is still not determined, although only rounding is left of it.
TEST(ArrowSystem, StretchesHideNothingThatIsNotDetermined) {
  ArrowSystem stretch(10, 0, 1), outer(0, 0, 1);
  for (int i = 0; i < 10; ++i)
    stretch.accumulate_residual(std::vector<Block>{{i, 1}, {10, 1}}, Eigen::RowVector2d(0.1, 0.3),
                                Eigen::VectorXd::Ones(1));
  outer.accumulate(std::vector<Block>{{0, 1}}, std::move(stretch).eliminate());
  EXPECT_FALSE(outer.solve().ok());
}

TEST(ArrowSystem, GuardsItsShape) {
  ArrowSystem system(10, 2, 2);
  const auto add = [&](std::vector<Block> blocks, int n) {
    system.accumulate(blocks, Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd::Zero(n));
  };
  EXPECT_THROW(add({{9, 2}}, 2), std::invalid_argument);
  EXPECT_THROW(add({{11, 2}}, 2), std::invalid_argument);
  EXPECT_THROW(add({{-1, 1}}, 1), std::invalid_argument);
  EXPECT_THROW(add({{0, 1}, {3, 1}}, 2), std::invalid_argument);
  EXPECT_THROW(add({{0, 1}, {2, 1}}, 3), std::invalid_argument);
  EXPECT_NO_THROW(add({{0, 1}, {2, 1}, {10, 2}}, 4));
}

}  // namespace
}  // namespace takt
