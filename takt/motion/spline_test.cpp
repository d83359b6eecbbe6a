// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/spline.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <limits>

#include "takt/math/check_derivative.h"

namespace takt {
namespace {

constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();

template <class OrderConstant>
struct SplineLaws : testing::Test {
  static constexpr int order = OrderConstant::value;
  static constexpr double interval = 0.13;
  static constexpr int points = order + 7;
  using Spline = EuclideanSpline<2, order>;

  static Spline any() { return Spline(interval, Spline::Points::Random(2, points)); }
  static std::vector<double> instants(double duration) {
    std::vector<double> t;
    for (int i = 0; i <= 40; ++i) t.push_back(duration * i / 40);
    return t;
  }
};
using Orders = testing::Types<std::integral_constant<int, 3>, std::integral_constant<int, 4>,
                              std::integral_constant<int, 5>, std::integral_constant<int, 6>>;
TYPED_TEST_SUITE(SplineLaws, Orders);

TYPED_TEST(SplineLaws, WeightsPartitionUnity) {
  const auto spline = this->any();
  for (double t : this->instants(spline.duration_s())) {
    const auto w = spline.evaluate(t).weights;
    EXPECT_NEAR(w.value.sum(), 1, rounding);
    EXPECT_GE(w.value.minCoeff(), -rounding);
    EXPECT_NEAR(w.d1.sum(), 0, rounding / this->interval * 10);
    EXPECT_NEAR(w.d2.sum(), 0, rounding / (this->interval * this->interval) * 10);
  }
}

// Marsden's identity: control points at the knot averages reproduce t; a constant and a line come out exactly.
TYPED_TEST(SplineLaws, ReproducesALine) {
  constexpr int k = TestFixture::order;
  typename TestFixture::Spline::Points c(2, this->points);
  for (int i = 0; i < this->points; ++i) {
    const double greville = (i - 0.5 * (k - 2)) * this->interval;
    c.col(i) << 3 - 2 * greville, 7;
  }
  const typename TestFixture::Spline spline(this->interval, c);
  for (double t : this->instants(spline.duration_s())) {
    const auto p = spline.evaluate(t);
    EXPECT_NEAR(p.value.x(), 3 - 2 * t, 10 * rounding);
    EXPECT_NEAR(p.value.y(), 7, 10 * rounding);
    EXPECT_NEAR(p.velocity.x(), -2, 1e-12);
    EXPECT_NEAR(p.acceleration.norm(), 0, 1e-10);
  }
}

// Any polynomial of the spline's degree is in its span: interpolating it at enough instants gives it back everywhere.
TYPED_TEST(SplineLaws, ReproducesPolynomialsOfItsDegree) {
  constexpr int k = TestFixture::order;
  const auto knots = UniformKnots<k>(this->interval, this->points);
  const auto f = [&](double t) {
    double v = 0;
    for (int n = k - 1; n >= 0; --n) v = v * t + (n % 2 ? 1.5 : -1);
    return v;
  };
  const EuclideanSpline<1, k> shape(this->interval, Eigen::RowVectorXd::Zero(this->points));
  const auto at = this->instants(knots.duration_s());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(at.size(), this->points);
  Eigen::VectorXd y(at.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    const auto p = shape.evaluate(at[i]);
    a.row(i).segment<k>(p.first) = p.weights.value;
    y[i] = f(at[i]);
  }
  const EuclideanSpline<1, k> fitted(this->interval, a.colPivHouseholderQr().solve(y).transpose());
  for (double t = 0.003; t < knots.duration_s(); t += 0.0171) EXPECT_NEAR(fitted(t)[0], f(t), 1e-11);
}

TYPED_TEST(SplineLaws, DerivativesAreDerivatives) {
  const auto spline = this->any();
  for (double x : {0.3, 1.5, 4.7}) {
    const double t = x * this->interval;
    const auto at = spline.evaluate(t);
    const auto moved = [&](const Eigen::VectorXd& d) { return spline.evaluate(t + d[0]); };
    EXPECT_TRUE(is_derivative(
        at.velocity, [&](const auto& d) -> Eigen::VectorXd { return moved(d).value; }, 1e-8, 0.02));
    EXPECT_TRUE(is_derivative(
        at.acceleration, [&](const auto& d) -> Eigen::VectorXd { return moved(d).velocity; }, 1e-8, 0.02));
  }
}

TYPED_TEST(SplineLaws, WeightsAreTheJacobiansToTheControlPoints) {
  const auto spline = this->any();
  const auto at = spline.evaluate(0.31);
  for (int i = 0; i < this->points; ++i) {
    const int local = i - at.first;
    const bool acts = local >= 0 && local < TestFixture::order;
    const auto moved = [&](const Eigen::VectorXd& d) {
      auto copy = spline;
      copy.control_point(i) += d;
      const auto p = copy.evaluate(0.31);
      Eigen::VectorXd all(6);
      all << p.value, p.velocity, p.acceleration;
      return all;
    };
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, 2);
    if (acts) {
      expected.topRows<2>().diagonal().setConstant(at.weights.value[local]);
      expected.middleRows<2>(2).diagonal().setConstant(at.weights.d1[local]);
      expected.bottomRows<2>().diagonal().setConstant(at.weights.d2[local]);
    }
    EXPECT_TRUE(is_derivative(expected, moved)) << "control point " << i;
  }
}

// All derivatives up to degree − 1 pass the knots without a jump.
TYPED_TEST(SplineLaws, IsContinuousAcrossKnots) {
  const auto spline = this->any();
  for (int k = 1; k < spline.knots().segments(); ++k) {
    const double knot = k * this->interval, tiny = 1e-9 * this->interval;
    const auto before = spline.evaluate(knot - tiny), after = spline.evaluate(knot + tiny);
    EXPECT_EQ(after.first, before.first + 1);
    EXPECT_LT((after.value - before.value).norm(), 1e-7);
    EXPECT_LT((after.velocity - before.velocity).norm(), 1e-7 / this->interval);
    if (TestFixture::order > 3) {
      EXPECT_LT((after.acceleration - before.acceleration).norm(), 1e-6 / (this->interval * this->interval));
    }
  }
}

TYPED_TEST(SplineLaws, FewerDerivativesGiveTheSameValues) {
  const auto spline = this->any();
  const auto all = spline.evaluate(0.2);
  EXPECT_EQ(spline.template evaluate<0>(0.2).value, all.value);
  EXPECT_EQ(spline.template evaluate<1>(0.2).velocity, all.velocity);
  EXPECT_EQ(spline(0.2), all.value);
}

TYPED_TEST(SplineLaws, RangeIsClosedAndGuarded) {
  const auto spline = this->any();
  const double end = spline.duration_s();
  EXPECT_NO_THROW((void)spline(0));
  EXPECT_NO_THROW((void)spline(end));
  for (double t : {-1e-9, end + 1e-9, double(NAN)}) EXPECT_THROW((void)spline(t), std::out_of_range) << t;
  try {
    (void)spline(-0.25);
  } catch (const std::out_of_range& e) {
    EXPECT_NE(std::string(e.what()).find("-0.25"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find(std::to_string(end)), std::string::npos) << e.what();
  }
  EXPECT_THROW(UniformKnots<TestFixture::order>(0.1, TestFixture::order - 1), std::invalid_argument);
  EXPECT_THROW(UniformKnots<TestFixture::order>(0, 20), std::invalid_argument);
}

TYPED_TEST(SplineLaws, CoveringKnotsEndWhereAsked) {
  const auto knots = UniformKnots<TestFixture::order>::covering(1.0, 0.3);
  EXPECT_EQ(knots.segments(), 4);
  EXPECT_NEAR(knots.duration_s(), 1, rounding);
  EXPECT_EQ((UniformKnots<TestFixture::order>::covering(1.0, 0.1).segments()), 10);
}

TEST(SplineBasis, IsTheTextbooksCubic) {
  constexpr BasisMatrix<4> m = uniform_basis<4>();
  const double expected[4][4] = {{1, -3, 3, -1}, {4, 0, -6, 3}, {1, 3, 3, -3}, {0, 0, 0, 1}};
  for (int s = 0; s < 4; ++s)
    for (int n = 0; n < 4; ++n) EXPECT_NEAR(6 * m[s][n], expected[s][n], 1e-15);
}

}  // namespace
}  // namespace takt
