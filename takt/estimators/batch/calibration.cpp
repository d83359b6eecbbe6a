// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/calibration.h"

#include <algorithm>

namespace takt::batch {

BiasCurve::BiasCurve(double begin, double end, double interval_s)
    : begin_s(begin), knots(UniformKnots<order>::covering(std::max(1e-3, end - begin), interval_s)) {
  gyro_points = Eigen::Matrix3Xd::Zero(3, knots.control_points());
  accel_points = gyro_points;
}

BiasCurve::Place BiasCurve::at(double t) const {
  static constexpr BasisMatrix<order> basis = uniform_basis<order>();
  const KnotPlace place = knots.locate(std::clamp(t - begin_s, 0.0, knots.duration_s()));
  return {place.first, weights_at<order, 0>(basis, place.u, knots.interval_s()).value};
}

Vec3 response_of(const ImuLink& imu) {
  return {imu.gyro_bend_s2, imu.accel_bend_s2, imu.accel_lag_s};
}

namespace {

void retract_pose(Rigid& T, int rotation, int translation, const Eigen::Ref<const Eigen::VectorXd>& step) {
  if (rotation >= 0) T.rotation = (T.rotation * exp_so3(Vec3(step.segment<3>(rotation)))).normalized();
  if (translation >= 0) T.translation += step.segment<3>(translation);
}

void retract(ImuLink& imu, const BorderLayout::Imu& at, const Eigen::Ref<const Eigen::VectorXd>& step) {
  retract_pose(imu.T_body_imu, at.rotation, at.translation, step);
  if (at.offset >= 0) imu.offset_s += step[at.offset];
  if (at.drift >= 0) imu.drift += step[at.drift];
  if (at.matrices >= 0) {
    int next = at.matrices;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) imu.gyro_matrix(row, column) += step[next++];
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column <= row; ++column) imu.accel_matrix(row, column) += step[next++];
  }
  if (at.response >= 0) {
    imu.gyro_bend_s2 += step[at.response];
    imu.accel_bend_s2 += step[at.response + 1];
    imu.accel_lag_s += step[at.response + 2];
  }
  if (at.bias >= 0)
    for (int k = 0; k < imu.bias.points(); ++k) {
      imu.bias.gyro_points.col(k) += step.segment<3>(at.bias + 6 * k);
      imu.bias.accel_points.col(k) += step.segment<3>(at.bias + 6 * k + 3);
    }
}

}  // namespace

void retract(Calibration& c, const BorderLayout& layout, const Eigen::Ref<const Eigen::VectorXd>& step) {
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const BorderLayout::Camera& at = layout.cameras[i];
    CameraLink& link = c.cameras[i];
    retract_pose(link.T_imu_cam, at.rotation, at.translation, step);
    if (at.offset >= 0) link.offset_s += step[at.offset];
    if (at.drift >= 0) link.drift += step[at.drift];
    if (at.line_delay >= 0) link.line_delay_s += step[at.line_delay];
  }
  for (std::size_t i = 0; i < c.imus.size(); ++i) retract(c.imus[i], layout.imus[i], step);
  if (layout.gravity >= 0) c.gravity_board += step.segment<3>(layout.gravity);
  if (layout.board_scale >= 0) c.board_scale += step[layout.board_scale];
}

namespace {

/// A control point of the biases is near its neighbours, so faintly that only one without any reading feels it: in a
/// gap of more than three intervals.
void hold_biases(const BiasCurve& bias, int first, ArrowSystem& system) {
  constexpr double gyro_sigma = 0.05, accel_sigma = 1;  // rad/s, m/s²; of neighbours' difference
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  Vec6 weight;
  weight << Vec3::Constant(1 / (gyro_sigma * gyro_sigma)), Vec3::Constant(1 / (accel_sigma * accel_sigma));
  const Eigen::Matrix<double, 6, 6> w = weight.asDiagonal();
  Eigen::Matrix<double, 12, 12> h;
  h << w, -w, -w, w;
  for (int k = 0; k + 1 < bias.points(); ++k) {
    Vec6 apart;
    apart << bias.gyro_points.col(k + 1) - bias.gyro_points.col(k),
        bias.accel_points.col(k + 1) - bias.accel_points.col(k);
    Eigen::Matrix<double, 12, 1> gradient;
    gradient << -w * apart, w * apart;
    const ArrowSystem::Block blocks[] = {{first + 6 * k, 12}};
    system.accumulate(blocks, h, gradient);
  }
}

}  // namespace

void add_priors(const Calibration& c, const BorderLayout& layout, int border, ArrowSystem& system) {
  constexpr double loose_gravity_sigma = 0.5, earth_gravity_sigma = 0.02, scale_sigma = 1;
  const bool is_measure = std::ranges::any_of(layout.imus, [](const auto& at) { return at.matrices >= 0; });
  const double gravity_sigma = is_measure ? earth_gravity_sigma : loose_gravity_sigma;
  const Vec3 along = c.gravity_board.normalized() / gravity_sigma;
  const ArrowSystem::Block gravity[] = {{border + layout.gravity, 3}};
  system.accumulate(gravity, along * along.transpose(),
                    (c.gravity_board.norm() - earth_gravity) / gravity_sigma * along);
  for (std::size_t m = 0; m < c.imus.size(); ++m)
    if (layout.imus[m].bias >= 0) hold_biases(c.imus[m].bias, border + layout.imus[m].bias, system);
  if (layout.board_scale < 0) return;
  const ArrowSystem::Block scale[] = {{border + layout.board_scale, 1}};
  using One = Eigen::Matrix<double, 1, 1>;
  system.accumulate(scale, One(1 / (scale_sigma * scale_sigma)),
                    One((c.board_scale - 1) / (scale_sigma * scale_sigma)));
}

}  // namespace takt::batch
