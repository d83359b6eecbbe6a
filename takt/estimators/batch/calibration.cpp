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

void retract(Calibration& c, const BorderLayout& layout, const Eigen::Ref<const Eigen::VectorXd>& step) {
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const BorderLayout::Camera& at = layout.cameras[i];
    CameraLink& link = c.cameras[i];
    if (at.rotation >= 0)
      link.T_imu_cam.rotation = (link.T_imu_cam.rotation * exp_so3(Vec3(step.segment<3>(at.rotation)))).normalized();
    if (at.translation >= 0) link.T_imu_cam.translation += step.segment<3>(at.translation);
    if (at.offset >= 0) link.offset_s += step[at.offset];
    if (at.drift >= 0) link.drift += step[at.drift];
    if (at.line_delay >= 0) link.line_delay_s += step[at.line_delay];
  }
  if (layout.gravity >= 0) c.gravity_board += step.segment<3>(layout.gravity);
  if (layout.board_scale >= 0) c.board_scale += step[layout.board_scale];
  if (layout.bias >= 0)
    for (int k = 0; k < c.bias.points(); ++k) {
      c.bias.gyro_points.col(k) += step.segment<3>(layout.bias + 6 * k);
      c.bias.accel_points.col(k) += step.segment<3>(layout.bias + 6 * k + 3);
    }
}

void add_priors(const Calibration& c, const BorderLayout& layout, int border, ArrowSystem& system) {
  constexpr double gravity_sigma = 0.5, scale_sigma = 1;
  const Vec3 along = c.gravity_board.normalized() / gravity_sigma;
  const ArrowSystem::Block gravity[] = {{border + layout.gravity, 3}};
  system.accumulate(gravity, along * along.transpose(),
                    (c.gravity_board.norm() - earth_gravity) / gravity_sigma * along);
  if (layout.board_scale < 0) return;
  const ArrowSystem::Block scale[] = {{border + layout.board_scale, 1}};
  using One = Eigen::Matrix<double, 1, 1>;
  system.accumulate(scale, One(1 / (scale_sigma * scale_sigma)),
                    One((c.board_scale - 1) / (scale_sigma * scale_sigma)));
}

}  // namespace takt::batch
