// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/rigid.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

const Rigid T_a_b{exp_so3({0.3, -1.2, 2.0}), {1, 2, 3}};
const Rigid T_b_c{exp_so3({-2.1, 0.2, 0.5}), {-4, 0.5, 9}};

TEST(Rigid, MovesPointsLikeItsMatrix) {
  const Vec3 p(0.1, -7, 2);
  EXPECT_LT((T_a_b * p - (T_a_b.matrix() * p.homogeneous()).head<3>()).norm(), 1e-14);
}

TEST(Rigid, ComposesFromRightToLeft) {
  const Vec3 p(3, 1, -2);
  EXPECT_LT(((T_a_b * T_b_c) * p - T_a_b * (T_b_c * p)).norm(), 1e-13);
  EXPECT_LT(((T_a_b * T_b_c).matrix() - T_a_b.matrix() * T_b_c.matrix()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Rigid, InverseUndoes) {
  EXPECT_LT(((T_a_b * T_a_b.inverse()).matrix() - Mat4::Identity()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((T_a_b.inverse().matrix() - T_a_b.matrix().inverse()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Rigid, ComesBackFromItsMatrix) {
  EXPECT_LT((Rigid::from_matrix(T_a_b.matrix()).matrix() - T_a_b.matrix()).cwiseAbs().maxCoeff(), 1e-14);
  Mat4 rounded = T_a_b.matrix();
  rounded.topLeftCorner<3, 3>() = (rounded.topLeftCorner<3, 3>() * 1e4).array().round() / 1e4;
  const Rigid clean = Rigid::from_matrix(rounded);
  EXPECT_NEAR(clean.rotation.norm(), 1, 1e-15);
  EXPECT_LT(log_so3(clean.rotation.conjugate() * T_a_b.rotation).norm(), 1e-4);
}

TEST(Rigid, RefusesWhatIsNotRigid) {
  Mat4 m = T_a_b.matrix();
  m.col(0) *= -1;
  EXPECT_THROW((void)Rigid::from_matrix(m), std::invalid_argument);
  m = 2 * Mat4::Identity();
  EXPECT_THROW((void)Rigid::from_matrix(m), std::invalid_argument);
  m = Mat4::Identity();
  m(3, 0) = 1;
  EXPECT_THROW((void)Rigid::from_matrix(m), std::invalid_argument);
  m = Mat4::Identity();
  m(0, 3) = NAN;
  EXPECT_THROW((void)Rigid::from_matrix(m), std::invalid_argument);
}

}  // namespace
}  // namespace takt
