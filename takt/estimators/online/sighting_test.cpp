// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/sighting.h"

#include <gtest/gtest.h>

#include "takt/math/check_derivative.h"
#include "takt/motion/trajectory.h"
#include "takt/simulation/motion.h"

namespace takt::online {
namespace {

const CameraModel camera{.width = 640,
                         .height = 480,
                         .fx = 400,
                         .fy = 410,
                         .cx = 320,
                         .cy = 240,
                         .distortion = Distortion::radtan,
                         .coeffs = {-0.28, 0.07, 2e-4, 2e-5}};

/// A trajectory's IMU, noise-free.
ImuHistory history_of(const Trajectory& truth, double rate_hz, double duration_s) {
  ImuHistory imu;
  for (int i = 0; i <= static_cast<int>(rate_hz * duration_s); ++i) {
    const double t = i / rate_hz;
    imu.add(t, {truth.omega_body(t), truth.specific_force_body(t)});
  }
  return imu;
}

Motion true_motion(const Trajectory& truth, double t) {
  Motion m;
  m.R = Quat(truth.world_from_body(t).linear());
  m.p = truth.world_from_body(t).translation();
  m.v = truth.velocity_world(t);
  return m;
}

struct Scene {
  std::shared_ptr<const Trajectory> truth = make_trajectory(find_motion("fast"), 3);
  ImuHistory imu = history_of(*truth, 400, 2);
  Sighting z = *see(camera, {411.3, 77.9});
  Clone clone;
  Extrinsics extrinsics;
  Landmark landmark;
  double line_delay_s = 5e-5;

  explicit Scene(bool rolling) {
    const Motion m = true_motion(*truth, 1);
    clone = {m.R, m.R, m.p, m.p, {}};
    if (rolling) clone.readout = ReadoutMotion(imu, m, 1, 0.0133);
    extrinsics.R_imu_cam = exp_so3({0.3, -0.9, 0.4}).toRotationMatrix();
    extrinsics.p_imu_cam = {0.05, -0.02, 0.11};
    // Near the measured bearing, 2.2 m away.
    landmark.origin = m.p + Vec3(0.4, 0.1, -0.2);
    const Vec3 point =
        m.p + m.R * (extrinsics.R_imu_cam * (2.2 * z.bearing + Vec3(0.02, 0.05, 0)) + extrinsics.p_imu_cam);
    landmark.direction = (point - landmark.origin).normalized();
    landmark.inverse_distance = 1 / (point - landmark.origin).norm();
  }
  [[nodiscard]] Observed observed() const { return *observe(z, clone, extrinsics, line_delay_s, landmark, true); }
};

TEST(Sighting, ResidualIsInPixels) {
  const Vec2 at(200.5, 130.25);
  const Sighting z = *see(camera, at);
  EXPECT_LT((z.misfit * z.bearing).norm(), 1e-12);
  const Vec2 off(0.3, -0.2);
  const Vec2 residual = z.misfit * *camera.bearing(at + off);
  EXPECT_NEAR(residual.x(), off.x(), 1e-3);
  EXPECT_NEAR(residual.y(), off.y(), 1e-3);
}

class Jacobians : public testing::TestWithParam<bool> {};

TEST_P(Jacobians, OfThePose) {
  const Scene s(GetParam());
  const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    Clone moved = s.clone;
    moved.R = moved.R * exp_so3(d.head<3>());
    moved.p += d.tail<3>();
    return *residual(s.z, moved, s.extrinsics, s.line_delay_s, s.landmark);
  };
  EXPECT_TRUE(is_derivative(s.observed().pose, f, 1e-7, 1e-3));
}

TEST_P(Jacobians, OfTheLandmark) {
  const Scene s(GetParam());
  const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    Landmark l = s.landmark;
    l.direction = (l.direction + tangents(l.direction) * d.head<2>()).normalized();
    l.inverse_distance += d[2];
    return *residual(s.z, s.clone, s.extrinsics, s.line_delay_s, l);
  };
  EXPECT_TRUE(is_derivative(s.observed().landmark, f, 1e-7, 1e-3));
}

TEST_P(Jacobians, OfTheMounting) {
  const Scene s(GetParam());
  const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    Extrinsics x = s.extrinsics;
    x.R_imu_cam = x.R_imu_cam * exp_so3(d.head<3>()).toRotationMatrix();
    x.p_imu_cam += d.tail<3>();
    return *residual(s.z, s.clone, x, s.line_delay_s, s.landmark);
  };
  EXPECT_TRUE(is_derivative(s.observed().extrinsics, f, 1e-7, 1e-3));
}

INSTANTIATE_TEST_SUITE_P(GlobalAndRolling, Jacobians, testing::Bool());

TEST(Sighting, LineDelayMovesARowAlongTheMotion) {
  const Scene s(true);
  const double d = 1e-6;
  const Vec2 later = *residual(s.z, s.clone, s.extrinsics, s.line_delay_s + d, s.landmark);
  const Vec2 earlier = *residual(s.z, s.clone, s.extrinsics, s.line_delay_s - d, s.landmark);
  const Vec2 numeric = (later - earlier) / (2 * d), analytic = s.observed().line_delay;
  // Between its knots the readout's motion is interpolated, and so is its derivative.
  EXPECT_LT((numeric - analytic).norm(), 0.02 * analytic.norm());
}

/// H_td = H_θ·ω + H_p·v [Li2014]: what the filter writes into a clone, against moving the clone in time.
TEST(Sighting, OffsetMovesAClonesSightAlongTheMotion) {
  const Scene s(false);
  const auto seen_at = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    const Motion m = carried(true_motion(*s.truth, 1), s.imu, 1, 1 + d[0]);
    return *residual(s.z, {m.R, m.R, m.p, m.p, {}}, s.extrinsics, 0, s.landmark);
  };
  Eigen::Matrix<double, 6, 1> derivative;
  derivative << s.truth->omega_body(1), s.truth->velocity_world(1);
  const Eigen::MatrixXd analytic = s.observed().pose * derivative;
  EXPECT_TRUE(is_derivative(analytic, seen_at, 1e-4, 1e-3));
}

TEST(Sighting, PointsAreFoundFarAndNear) {
  const Scene s(false);
  for (const double distance : {0.7, 3.0, 1e5}) {
    std::vector<Clone> clones;
    std::vector<Sighting> sightings;
    const Motion middle = true_motion(*s.truth, 1);
    const Vec3 point = middle.p + middle.R * (s.extrinsics.R_imu_cam * (distance * Vec3(0.1, 0.05, 1).normalized()));
    for (int k = -3; k <= 3; ++k) {
      const Motion m = true_motion(*s.truth, 1 + 0.03 * k);
      const Vec3 in_camera =
          s.extrinsics.R_imu_cam.transpose() * (m.R.conjugate() * (point - m.p) - s.extrinsics.p_imu_cam);
      const auto pixel = camera.project(in_camera);
      if (!pixel) continue;
      clones.push_back({m.R, m.R, m.p, m.p, {}});
      sightings.push_back(*see(camera, *pixel));
    }
    ASSERT_GE(clones.size(), 3u);
    std::vector<SeenFrom> seen;
    for (std::size_t k = 0; k < clones.size(); ++k) seen.push_back({&sightings[k], &clones[k], &s.extrinsics, 0});
    double rms_px = 1;
    const auto found = triangulate(seen, &rms_px);
    ASSERT_TRUE(found);
    EXPECT_LT(rms_px, 0.02);
    const double true_nearness = 1 / (point - found->origin).norm();
    EXPECT_NEAR(found->inverse_distance, true_nearness, 0.01 * true_nearness + 1e-4);
  }
}

TEST(Sighting, ProjectionFreesRowsOfTheLandmark) {
  Eigen::MatrixXd landmark = Eigen::MatrixXd::Random(10, 3), states = Eigen::MatrixXd::Random(10, 7);
  Eigen::VectorXd r = Eigen::VectorXd::Random(10);
  // A row space vector of the null space: N from a full QR.
  const Eigen::MatrixXd Q = landmark.householderQr().householderQ();
  const Eigen::MatrixXd N = Q.rightCols(7);
  const Eigen::MatrixXd expected = states.transpose() * N * N.transpose() * states;
  const double squares = (N.transpose() * r).squaredNorm();
  Eigen::Matrix<double, Eigen::Dynamic, 3> l = landmark;
  project_out(l, states, r);
  EXPECT_TRUE((states.bottomRows(7).transpose() * states.bottomRows(7)).isApprox(expected, 1e-10));
  EXPECT_NEAR(r.tail(7).squaredNorm(), squares, 1e-12);
}

TEST(ImuMotion, FollowsATrajectory) {
  const auto truth = make_trajectory(find_motion("handheld"), 5);
  const ImuHistory imu = history_of(*truth, 200, 3);
  Motion m = true_motion(*truth, 0.0123);
  propagate(m, imu, 0.0123, 2.4567, {}, nullptr);
  const Motion end = true_motion(*truth, 2.4567);
  EXPECT_LT(log_so3(m.R.conjugate() * end.R).norm(), 2e-6);
  EXPECT_LT((m.v - end.v).norm(), 2e-4);
  EXPECT_LT((m.p - end.p).norm(), 3e-4);
  const Motion back = carried(end, imu, 2.4567, 0.0123);
  EXPECT_LT((back.p - true_motion(*truth, 0.0123).p).norm(), 3e-4);
}

TEST(ImuMotion, ErrorsGrowAsTheTransitionSays) {
  const auto truth = make_trajectory(find_motion("handheld"), 5);
  const ImuHistory imu = history_of(*truth, 200, 1);
  const Motion start = true_motion(*truth, 0.1);
  Motion end = start;
  Transition by;
  propagate(end, imu, 0.1, 0.7, {}, &by);
  const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    Motion m = start;
    m.add(d);
    propagate(m, imu, 0.1, 0.7, {}, nullptr);
    Vec15 out;
    out << log_so3(end.R.conjugate() * m.R), m.p - end.p, m.v - end.v, m.gyro_bias - end.gyro_bias,
        m.accel_bias - end.accel_bias;
    return out;
  };
  // The bias's share within one sample interval is taken to first order.
  EXPECT_TRUE(is_derivative(by.transition, f, 2e-4, 1e-3));
}

}  // namespace
}  // namespace takt::online
