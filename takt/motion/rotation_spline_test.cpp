// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/rotation_spline.h"

#include <gtest/gtest.h>

#include <random>

#include "takt/math/check_derivative.h"

namespace takt {
namespace {

template <class OrderConstant>
struct RotationSplineLaws : testing::Test {
  static constexpr int order = OrderConstant::value;
  static constexpr double interval = 0.2;
  static constexpr int points = order + 5;
  using Spline = RotationSpline<order>;

  /// A random walk of orientations with steps of about half a radian: brisk motion.
  static std::vector<Quat> walk() {
    std::mt19937 random(11);
    std::normal_distribution<double> normal(0, 0.3);
    std::vector<Quat> q{exp_so3({1, -2, 0.5})};
    for (int i = 1; i < points; ++i)
      q.push_back(q.back() * exp_so3(Vec3(normal(random), normal(random), normal(random))));
    return q;
  }
  static Spline any() { return Spline(interval, walk()); }
  static std::vector<double> instants() {
    std::vector<double> t;
    for (int i = 0; i <= 30; ++i) t.push_back((points - order + 1) * interval * i / 30);
    t.push_back(1.5e-3 * interval);  // small λ: the series branches
    return t;
  }
};
using Orders = testing::Types<std::integral_constant<int, 3>, std::integral_constant<int, 4>,
                              std::integral_constant<int, 5>, std::integral_constant<int, 6>>;
TYPED_TEST_SUITE(RotationSplineLaws, Orders);

TYPED_TEST(RotationSplineLaws, IsTheCumulativeProduct) {
  constexpr int k = TestFixture::order;
  const auto q = this->walk();
  const auto spline = this->any();
  const auto basis = cumulative_basis<k>();
  for (double t : this->instants()) {
    const auto at = spline.evaluate(t);
    const double u = t / this->interval - at.first;
    Quat expected = q[at.first];
    for (int j = 1; j < k; ++j) {
      double lambda = 0;
      for (int n = 0; n < k; ++n) lambda += basis[j][n] * std::pow(u, n);
      expected = expected * exp_so3(lambda * log_so3(q[at.first + j - 1].conjugate() * q[at.first + j]));
    }
    EXPECT_LT(log_so3(expected.conjugate() * at.rotation).norm(), 1e-14);
  }
}

TYPED_TEST(RotationSplineLaws, ReproducesAConstantRate) {
  const Vec3 rate(1.0, -0.7, 2.2);
  const Quat start = exp_so3({0.1, 0.2, 0.3});
  std::vector<Quat> q;
  for (int i = 0; i < this->points; ++i)
    q.push_back(start * exp_so3((i - 0.5 * (TestFixture::order - 2)) * this->interval * rate));
  const typename TestFixture::Spline spline(this->interval, q);
  for (double t : this->instants()) {
    const auto m = spline.evaluate(t);
    EXPECT_LT(log_so3((start * exp_so3(t * rate)).conjugate() * m.rotation).norm(), 1e-14);
    EXPECT_LT((m.velocity - rate).norm(), 1e-13);
    EXPECT_LT(m.acceleration.norm(), 1e-11);
  }
}

TYPED_TEST(RotationSplineLaws, AboutOneAxisIsTheEuclideanSpline) {
  constexpr int k = TestFixture::order;
  const Vec3 axis = Vec3(1, 2, -2) / 3;
  const Eigen::VectorXd angles = Eigen::VectorXd::Random(this->points);
  std::vector<Quat> q;
  for (double a : angles) q.push_back(exp_so3(a * axis));
  const typename TestFixture::Spline spline(this->interval, q);
  for (double t : this->instants()) {
    const KnotPlace place = spline.knots().locate(t);
    const auto w = weights_at<k, 2>(uniform_basis<k>(), place.u, this->interval);
    const auto active = angles.template segment<k>(place.first);
    const auto m = spline.evaluate(t);
    EXPECT_LT((log_so3(m.rotation) - active.dot(w.value) * axis).norm(), 1e-14);
    EXPECT_LT((m.velocity - active.dot(w.d1) * axis).norm(), 1e-12);
    EXPECT_LT((m.acceleration - active.dot(w.d2) * axis).norm(), 1e-11);
  }
}

TYPED_TEST(RotationSplineLaws, DerivativesInTimeAreDerivatives) {
  const auto spline = this->any();
  for (double x : {0.45, 1.6, 4.4}) {
    const double t = x * this->interval;
    const auto at = spline.evaluate(t);
    EXPECT_TRUE(is_derivative(at.velocity, [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      return log_so3(at.rotation.conjugate() * spline(t + d[0]));
    }));
    EXPECT_TRUE(is_derivative(at.acceleration, [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      return spline.evaluate(t + d[0]).velocity;
    }));
  }
}

TYPED_TEST(RotationSplineLaws, JacobiansToTheControlPointsAreDerivatives) {
  const auto spline = this->any();
  for (double t : {0.0, 0.0003, 0.33, 0.71, spline.duration_s()}) {
    typename TestFixture::Spline::Jacobians jacobians;
    const auto at = spline.evaluate(t, jacobians);
    for (int i = 0; i < TestFixture::order; ++i) {
      const auto moved = [&](const Eigen::VectorXd& d) {
        auto copy = spline;
        Eigen::Matrix3Xd deltas = Eigen::Matrix3Xd::Zero(3, this->points);
        deltas.col(at.first + i) = d;
        copy.retract(deltas);
        const auto m = copy.evaluate(t);
        Eigen::VectorXd all(9);
        all << log_so3(at.rotation.conjugate() * m.rotation), m.velocity, m.acceleration;
        return all;
      };
      Eigen::Matrix<double, 9, 3> expected;
      expected << jacobians.rotation[i], jacobians.velocity[i], jacobians.acceleration[i];
      EXPECT_TRUE(is_derivative(expected, moved)) << "t = " << t << ", control point " << i;
    }
  }
}

TYPED_TEST(RotationSplineLaws, JacobiansDoNotChangeTheMotion) {
  const auto spline = this->any();
  typename TestFixture::Spline::Jacobians all, some;
  for (double t : this->instants()) {
    const auto plain = spline.evaluate(t);
    const auto with = spline.evaluate(t, all);
    EXPECT_EQ(plain.rotation.coeffs(), with.rotation.coeffs());
    EXPECT_EQ(plain.velocity, with.velocity);
    EXPECT_EQ(plain.acceleration, with.acceleration);
    EXPECT_EQ(spline(t).coeffs(), plain.rotation.coeffs());
    EXPECT_EQ(spline.template evaluate<1>(t, some).velocity, plain.velocity);
    for (int i = 0; i < TestFixture::order; ++i) {
      EXPECT_EQ(some.rotation[i], all.rotation[i]);
      EXPECT_EQ(some.velocity[i], all.velocity[i]);
    }
  }
}

TYPED_TEST(RotationSplineLaws, TurningTheWorldTurnsTheCurveAndNothingElse) {
  const Quat turn = exp_so3({-1, 0.4, 2});
  const auto spline = this->any();
  auto turned_points = this->walk();
  for (Quat& q : turned_points) q = turn * q;
  const typename TestFixture::Spline turned(this->interval, turned_points);
  for (double t : this->instants()) {
    const auto a = spline.evaluate(t), b = turned.evaluate(t);
    EXPECT_LT(log_so3((turn * a.rotation).conjugate() * b.rotation).norm(), 1e-14);
    EXPECT_LT((a.velocity - b.velocity).norm(), 1e-13);
    EXPECT_LT((a.acceleration - b.acceleration).norm(), 1e-12);
  }
}

TYPED_TEST(RotationSplineLaws, IsContinuousAcrossKnots) {
  const auto spline = this->any();
  for (int k = 1; k < spline.knots().segments(); ++k) {
    const double knot = k * this->interval, tiny = 1e-10 * this->interval;
    const auto before = spline.evaluate(knot - tiny), after = spline.evaluate(knot + tiny);
    EXPECT_EQ(after.first, before.first + 1);
    EXPECT_LT(log_so3(before.rotation.conjugate() * after.rotation).norm(), 1e-8);
    EXPECT_LT((after.velocity - before.velocity).norm(), 1e-6);
    if (TestFixture::order > 3) {
      EXPECT_LT((after.acceleration - before.acceleration).norm(), 1e-5);
    }
  }
}

TYPED_TEST(RotationSplineLaws, RangeAndShapesAreGuarded) {
  auto spline = this->any();
  EXPECT_NO_THROW((void)spline(spline.duration_s()));
  EXPECT_THROW((void)spline(-1e-9), std::out_of_range);
  EXPECT_THROW((void)spline(spline.duration_s() + 1e-9), std::out_of_range);
  EXPECT_THROW(spline.retract(Eigen::Matrix3Xd::Zero(3, 2)), std::invalid_argument);
  EXPECT_THROW(typename TestFixture::Spline(0.1, std::vector<Quat>(TestFixture::order - 1)), std::invalid_argument);
}

}  // namespace
}  // namespace takt
