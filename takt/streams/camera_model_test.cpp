// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "takt/math/check_derivative.h"

namespace takt {
namespace {

CameraModel pinhole() {
  CameraModel m = CameraModel::from_horizontal_fov(752, 480, 1.4);
  m.cx = 367.215;
  m.cy = 248.375;
  return m;
}
CameraModel radtan() {  // EuRoC cam0
  CameraModel m;
  m.width = 752, m.height = 480;
  m.fx = 458.654, m.fy = 457.296, m.cx = 367.215, m.cy = 248.375;
  m.distortion = Distortion::radtan;
  m.coeffs = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  return m;
}
CameraModel equidistant() {  // TUM-VI cam0
  CameraModel m;
  m.width = 512, m.height = 512;
  m.fx = 190.97847715128717, m.fy = 190.9733070521226, m.cx = 254.93170605935475, m.cy = 256.8974428996504;
  m.distortion = Distortion::equidistant;
  m.coeffs = {0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182};
  return m;
}

CameraModel fov() {
  CameraModel m = pinhole();
  m.distortion = Distortion::fov;
  m.coeffs = {0.92};
  return m;
}
CameraModel omni() {
  CameraModel m = radtan();
  m.projection = Projection::omni;
  m.shape = {1.32};
  m.fx = 820.3, m.fy = 818.9;
  m.coeffs = {-0.12, 0.03, 4e-4, -3e-4};
  return m;
}
CameraModel double_sphere() {
  CameraModel m = equidistant();
  m.distortion = Distortion::none;
  m.projection = Projection::double_sphere;
  m.shape = {-0.19, 0.59};
  m.fx = 158.3, m.fy = 158.2;
  return m;
}
CameraModel eucm() {
  CameraModel m = double_sphere();
  m.projection = Projection::eucm;
  m.shape = {0.63, 1.04};
  m.fx = 191.1, m.fy = 190.8;
  return m;
}

class CameraModels : public testing::TestWithParam<CameraModel> {};
INSTANTIATE_TEST_SUITE_P(All, CameraModels,
                         testing::Values(pinhole(), radtan(), equidistant(), fov(), omni(), double_sphere(), eucm()));

TEST_P(CameraModels, APixelsBearingProjectsBackToIt) {
  const CameraModel& m = GetParam();
  for (double v = 0; v < m.height; v += 7.3)
    for (double u = 0; u < m.width; u += 11.9) {
      const auto bearing = m.bearing({u, v});
      ASSERT_TRUE(bearing) << u << " " << v;
      EXPECT_NEAR(bearing->norm(), 1, 1e-12);
      const auto pixel = m.project(3.7 * *bearing);  // the distance does not matter
      ASSERT_TRUE(pixel) << u << " " << v;
      EXPECT_NEAR(pixel->x(), u, 1e-8);
      EXPECT_NEAR(pixel->y(), v, 1e-8);
    }
}

TEST_P(CameraModels, TheOpticalAxisIsThePrincipalPoint) {
  const CameraModel& m = GetParam();
  const auto pixel = m.project({0, 0, 2});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), m.cx, 1e-9);
  EXPECT_NEAR(pixel->y(), m.cy, 1e-9);
  EXPECT_TRUE(m.bearing({m.cx, m.cy})->isApprox(Vec3(0, 0, 1)));
}

TEST_P(CameraModels, ImageAxesPointRightAndDownWithTheFocalLengthAtTheCentre) {
  const CameraModel& m = GetParam();
  const double h = 1e-6;
  const Vec2 dx = (*m.project({h, 0, 1}) - *m.project({-h, 0, 1})) / (2 * h);
  const Vec2 dy = (*m.project({0, h, 1}) - *m.project({0, -h, 1})) / (2 * h);
  // The unified models shrink the centre too: x/(1 + xi) and their like.
  const double shrink = m.distortion == Distortion::fov             ? 2 * std::tan(0.5 * m.coeffs[0]) / m.coeffs[0]
                        : m.projection == Projection::omni          ? 1 / (1 + m.shape[0])
                        : m.projection == Projection::double_sphere ? 1 / (1 + m.shape[0])
                                                                    : 1;
  EXPECT_NEAR(dx.x(), shrink * m.fx, 1e-4);
  EXPECT_NEAR(dy.y(), shrink * m.fy, 1e-4);
}

TEST_P(CameraModels, JacobiansAreTheDerivativesAndThePixelIsTheSame) {
  const CameraModel& m = GetParam();
  for (const Vec2& pixel : {Vec2(90, 60), Vec2(300, 210), Vec2(460, 400), Vec2(m.cx, m.cy), Vec2(m.cx + 1, m.cy)}) {
    const Vec3 p = 1.7 * *m.bearing(pixel);
    const auto seen = project_with_jacobians(m, p);
    ASSERT_TRUE(seen);
    EXPECT_LT((seen->pixel - pixel).norm(), 1e-8);
    EXPECT_TRUE(is_derivative(seen->to_point, [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      return *m.project(p + Vec3(d));
    })) << pixel.transpose();
    const Intrinsics at = intrinsics_of(m);
    EXPECT_TRUE(is_derivative(seen->to_intrinsics, [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      return *with_intrinsics(m, at + d).project(p);
    })) << pixel.transpose();
  }
}

TEST_P(CameraModels, IntrinsicsHaveNamesAndSurviveTheRoundTrip) {
  const CameraModel& m = GetParam();
  const Intrinsics v = intrinsics_of(m);
  EXPECT_EQ(static_cast<std::size_t>(v.size()), intrinsic_names(m).size());
  const CameraModel again = with_intrinsics(m, v);
  EXPECT_EQ(again.coeffs, m.coeffs);
  EXPECT_EQ(again.shape, m.shape);
  EXPECT_EQ(again.cy, m.cy);
  EXPECT_THROW(static_cast<void>(with_intrinsics(m, Intrinsics::Zero(3))), std::invalid_argument);
}

// The formulas once more, written out from Kalibr's documentation of its models.
TEST(CameraModel, RadtanAsDocumented) {
  const CameraModel m = radtan();
  const auto [k1, k2, p1, p2] = m.coeffs;
  const double x = 0.31, y = -0.24, r2 = x * x + y * y;
  const double xd = x * (1 + k1 * r2 + k2 * r2 * r2) + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double yd = y * (1 + k1 * r2 + k2 * r2 * r2) + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  const auto pixel = m.project({2 * x, 2 * y, 2});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), m.fx * xd + m.cx, 1e-10);
  EXPECT_NEAR(pixel->y(), m.fy * yd + m.cy, 1e-10);
}

TEST(CameraModel, EquidistantAsDocumented) {
  const CameraModel m = equidistant();
  const double theta = 1.1, azimuth = 0.4;
  const double r = theta + m.coeffs[0] * std::pow(theta, 3) + m.coeffs[1] * std::pow(theta, 5) +
                   m.coeffs[2] * std::pow(theta, 7) + m.coeffs[3] * std::pow(theta, 9);
  const auto pixel =
      m.project(5 * Vec3(std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth), std::cos(theta)));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), m.fx * r * std::cos(azimuth) + m.cx, 1e-9);
  EXPECT_NEAR(pixel->y(), m.fy * r * std::sin(azimuth) + m.cy, 1e-9);
}

TEST(CameraModel, UnifiedModelsAsDocumented) {
  const Vec3 p(0.8, -0.5, 0.3);
  const auto expect_at = [&](const CameraModel& m, double denominator, const char* name) {
    const auto pixel = m.project(p);
    ASSERT_TRUE(pixel) << name;
    EXPECT_NEAR(pixel->x(), m.fx * p.x() / denominator + m.cx, 1e-9) << name;
    EXPECT_NEAR(pixel->y(), m.fy * p.y() / denominator + m.cy, 1e-9) << name;
  };
  const double d1 = p.norm(), k = -0.19 * d1 + p.z(), d2 = std::sqrt(0.89 + k * k);
  expect_at(double_sphere(), 0.59 * d2 + 0.41 * k, "double sphere");
  expect_at(eucm(), 0.63 * std::sqrt(1.04 * 0.89 + 0.09) + 0.37 * 0.3, "eucm");
  CameraModel plain = omni();
  plain.distortion = Distortion::none;
  expect_at(plain, p.z() + 1.32 * d1, "omni");
}

TEST(CameraModel, FovAsDocumented) {
  const double r = std::hypot(0.6, 0.25), w = 0.92;
  const double scale = std::atan(2 * r * std::tan(w / 2)) / (r * w);
  const auto pixel = fov().project({1.2, 0.5, 2});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), fov().fx * 0.6 * scale + fov().cx, 1e-9);
}

TEST(CameraModel, WhatCannotBeSeenIsNotProjected) {
  EXPECT_FALSE(fov().project({0.1, 0, -1}));
  EXPECT_FALSE(omni().project({0.1, 0, -1}));
  EXPECT_FALSE(double_sphere().project({0.1, 0, -1}));
  EXPECT_FALSE(eucm().project({0.1, 0, -1}));
  EXPECT_TRUE(double_sphere().project({1, 0, -0.2}));  // they too see a little behind themselves
  EXPECT_TRUE(eucm().project({1, 0, -0.2}));
  EXPECT_FALSE(pinhole().project({0, 0, -1}));
  EXPECT_FALSE(radtan().project({0.1, 0, 0}));
  EXPECT_FALSE(equidistant().project(Vec3::Zero()));
  EXPECT_TRUE(equidistant().project({1, 0, -0.1}));  // a fisheye sees a little behind itself
}

TEST(CameraModel, BeyondTheFoldOfTheDistortionNothingIsSeen) {
  CameraModel m = radtan();
  m.coeffs = {-0.5, 0.1, 0, 0};  // rises up to r = 1 (45°), falls, and rises again from r = √2
  EXPECT_TRUE(m.project({0.98, 0, 1}));
  EXPECT_FALSE(m.project({1.2, 0, 1}));
  EXPECT_FALSE(m.project({1.5, 0, 1}));  // would appear inside the image that r < 1 fills
  EXPECT_FALSE(m.bearing({m.cx + 0.7 * m.fx, m.cy}));
  m.coeffs = {-0.3, 0, 0, 0};  // folds at r = 1.054 and never recovers
  EXPECT_FALSE(m.project({1.1, 0, 1}));
  m.coeffs = {0.1, 0, 0, 0};  // pincushion never folds
  EXPECT_TRUE(m.project({3, 0, 1}));
}

TEST(CameraModel, FieldOfViewSpansTheImage) {
  const double fov = 70 * std::numbers::pi / 180;
  const CameraModel m = CameraModel::from_horizontal_fov(640, 480, fov);
  const double left = std::acos(m.bearing({-0.5, m.cy})->z()), right = std::acos(m.bearing({639.5, m.cy})->z());
  EXPECT_NEAR(left + right, fov, 1e-12);
}

}  // namespace
}  // namespace takt
