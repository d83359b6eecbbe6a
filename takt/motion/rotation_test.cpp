// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/rotation.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

#include "takt/math/check_derivative.h"

namespace takt {
namespace {

constexpr double pi = std::numbers::pi;
/// What a dozen operations on numbers of the size of 1 to π may round away.
constexpr double rounding = 16 * std::numeric_limits<double>::epsilon();
/// Angles around every branch of the closed forms: zero, the switch to series at 1e-2, the general case, π.
const double angles[] = {0,    1e-300, 1e-12, 1e-8,      1e-5,      9.99e-3,    1.001e-2,
                         0.05, 0.7,    2.0,   pi - 1e-3, pi - 1e-7, pi - 1e-10, pi - 1e-15};

std::vector<Vec3> axes() {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Vec3> out{Vec3::UnitX(), -Vec3::UnitZ()};
  for (int i = 0; i < 10; ++i) out.push_back(Vec3(normal(random), normal(random), normal(random)).normalized());
  return out;
}

/// The definition: Σ hat(φ)^n / n!, summed in long double.
Mat3 exp_by_series(const Vec3& phi) {
  using LMat = Eigen::Matrix<long double, 3, 3>;
  const LMat h = hat(phi).cast<long double>();
  LMat term = LMat::Identity(), sum = term;
  for (int n = 1; n < 60; ++n) sum += term = (term * h / n).eval();
  return sum.cast<double>();
}
/// Jr = Σ (−hat(φ))^n / (n+1)!.
Mat3 right_jacobian_by_series(const Vec3& phi) {
  using LMat = Eigen::Matrix<long double, 3, 3>;
  const LMat h = -hat(phi).cast<long double>();
  LMat term = LMat::Identity(), sum = term;
  for (int n = 1; n < 60; ++n) sum += term = (term * h / (n + 1)).eval();
  return sum.cast<double>();
}

TEST(Rotation, HatIsTheCrossProduct) {
  const Vec3 a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_TRUE((hat(a) * b).isApprox(a.cross(b)));
}

TEST(Rotation, ExpIsTheMatrixExponential) {
  for (const Vec3& axis : axes())
    for (double angle : angles) {
      const Quat q = exp_so3(angle * axis);
      EXPECT_NEAR(q.norm(), 1, 4e-16) << angle;
      EXPECT_LT((q.toRotationMatrix() - exp_by_series(angle * axis)).cwiseAbs().maxCoeff(), rounding) << angle;
    }
}

TEST(Rotation, LogUndoesExpToRounding) {
  for (const Vec3& axis : axes())
    for (double angle : angles) {
      const Vec3 phi = angle * axis;
      EXPECT_LT((log_so3(exp_so3(phi)) - phi).norm(), rounding) << angle;
    }
}

TEST(Rotation, LogKeepsRelativePrecisionNearZero) {
  for (const Vec3& axis : axes())
    for (double angle : {1e-200, 1e-15, 1e-9, 1e-6, 1e-3})
      EXPECT_LT((log_so3(exp_so3(angle * axis)) - angle * axis).norm(), 1e-15 * angle) << angle;
}

TEST(Rotation, LogIsTheShortWayRound) {
  for (const Vec3& axis : axes()) {
    const Quat q = exp_so3(2.0 * axis);
    EXPECT_LT((log_so3(Quat(-q.coeffs())) - 2.0 * axis).norm(), rounding);
    EXPECT_LT((log_so3(exp_so3((2 * pi - 0.3) * axis)) + 0.3 * axis).norm(), rounding);
    EXPECT_NEAR(log_so3(exp_so3(pi * axis)).norm(), pi, rounding);
    EXPECT_NEAR(log_so3(exp_so3((pi + 1e-9) * axis)).norm(), pi - 1e-9, rounding);
  }
}

TEST(Rotation, RightJacobianIsItsSeries) {
  for (const Vec3& axis : axes())
    for (double angle : angles)
      EXPECT_LT((right_jacobian(angle * axis) - right_jacobian_by_series(angle * axis)).cwiseAbs().maxCoeff(), rounding)
          << angle;
}

TEST(Rotation, ExpAndJacobianAreBoth) {
  for (const Vec3& axis : axes())
    for (double angle : angles) {
      const ExpAndJacobian both = exp_and_jacobian(angle * axis);
      EXPECT_EQ(both.rotation.coeffs(), exp_so3(angle * axis).coeffs());
      EXPECT_EQ(both.right_jacobian, right_jacobian(angle * axis));
    }
}

TEST(Rotation, RightJacobianInverseIsTheInverseUpToPi) {
  for (const Vec3& axis : axes())
    for (double angle : angles) {
      const Vec3 phi = angle * axis;
      const Mat3 product = right_jacobian_inverse(phi) * right_jacobian_by_series(phi);
      EXPECT_LT((product - Mat3::Identity()).cwiseAbs().maxCoeff(), rounding) << angle;
    }
}

TEST(Rotation, RightJacobiansAreDerivatives) {
  for (const Vec3& axis : axes())
    for (double angle : {0.0, 1e-9, 0.005, 0.3, 1.9, 3.0}) {
      const Vec3 phi = angle * axis;
      const Quat at = exp_so3(phi);
      EXPECT_TRUE(is_derivative(right_jacobian(phi), [&](const Vec3& d) -> Eigen::VectorXd {
        return log_so3(at.conjugate() * exp_so3(phi + d));
      })) << angle;
      EXPECT_TRUE(is_derivative(right_jacobian_inverse(phi), [&](const Vec3& d) -> Eigen::VectorXd {
        return log_so3(at * exp_so3(d));
      })) << angle;
    }
}

TEST(Rotation, AlignVectorsFindsTheRotation) {
  const Mat3 truth = exp_so3({0.4, -2.0, 1.1}).toRotationMatrix();
  Eigen::Matrix3Xd a = Eigen::Matrix3Xd::Random(3, 50);
  const VectorAlignment found = align_vectors(a, truth * a);
  EXPECT_LT((found.rotation - truth).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_GT(found.spread, 0.1);
}

TEST(Rotation, AlignVectorsNeverReflects) {
  // Vectors in a plane leave the sign of the third direction open; a rotation must come out all the same.
  Eigen::Matrix3Xd a = Eigen::Matrix3Xd::Random(3, 20);
  a.row(2).setZero();
  const Mat3 truth = exp_so3({2.2, 0.3, -1.0}).toRotationMatrix();
  const VectorAlignment planar = align_vectors(a, truth * a);
  EXPECT_LT((planar.rotation - truth).cwiseAbs().maxCoeff(), 1e-13);
  // Mirrored vectors have no rotation that fits; what comes out is still one.
  const Eigen::Matrix3Xd full = Eigen::Matrix3Xd::Random(3, 20);
  EXPECT_NEAR(align_vectors(full, Eigen::Matrix3Xd(-full)).rotation.determinant(), 1, 1e-14);
}

TEST(Rotation, ParallelVectorsHaveNoSpread) {
  const Eigen::Matrix3Xd a = Vec3(1, 2, 3) * Eigen::RowVectorXd::LinSpaced(9, -1, 1);
  EXPECT_LT(align_vectors(a, a).spread, 1e-15);
  EXPECT_EQ(align_vectors(Mat3(Mat3::Zero())).spread, 0);
}

}  // namespace
}  // namespace takt
