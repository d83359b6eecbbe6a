// SPDX-License-Identifier: Apache-2.0
// The IMUs' share of the spline model.
#include <algorithm>
#include <cmath>

#include "takt/estimators/batch/spline_model.h"

namespace takt::batch {

namespace {

/// Half the way over which what an IMU feels is differentiated in time (s).
constexpr double time_step_s = 2.5e-3;

/// Where the columns of a kind of residual stand; −1: it has none.
struct Columns {
  int knots = 0;  ///< six a control point
  int gravity = -1, bias = -1, rotation = -1, translation = -1, offset = -1, drift = -1, matrix = -1, response = -1;
  int size = 0;
};

/// Columns and, in the same order, the places of their unknowns in the system.
struct Plan {
  Columns at;
  std::vector<ArrowSystem::Block> blocks;

  int take(int place, int count) {
    blocks.push_back({place, count});
    const int column = at.size;
    at.size += count;
    return column;
  }
};

}  // namespace

/// Between frames that are near to each other only: elsewhere no camera says where the motion went.
void SplineModel::take_intervals() {
  std::vector<double> times;
  for (const SplineFrame& f : frames_) times.push_back(calibration_.cameras[f.camera].imu_time(f.time_s));
  std::ranges::sort(times);
  for (std::size_t k = 0; k + 1 < times.size(); ++k) {
    if (times[k + 1] - times[k] > longest_join_s + 0.05 || !imus_[0]->curve.covers(times[k], times[k + 1])) continue;
    if (!intervals_.empty() && intervals_.back().second == times[k])
      intervals_.back().second = times[k + 1];
    else
      intervals_.emplace_back(times[k], times[k + 1]);
  }
}

void SplineModel::take_samples() {
  samples_.clear();
  for (std::size_t m = 0; m < imus_.size(); ++m) {
    const ImuLink& link = calibration_.imus[m];
    const auto times = imus_[m]->curve.times_s();
    std::size_t i = 0;
    std::pair<int, int> segment{-1, -1};
    const auto segment_at = [&](double t) { return knots_.locate(t - begin_s_).first; };
    for (const auto& [from, to] : intervals_) {
      while (i < times.size() && link.body_time(times[i]) < from) ++i;
      for (; i < times.size() && link.body_time(times[i]) < to; ++i) {
        const double t = link.body_time(times[i]);
        const std::pair<int, int> at{segment_at(t), segment_at(t - link.accel_lag_s)};
        const bool new_span =
            at != segment || samples_.empty() || samples_.back().imu != m || samples_.back().last != i;
        if (new_span) samples_.push_back({m, i, i});
        segment = at;
        samples_.back().last = i + 1;
      }
    }
  }
}

SplineModel::Felt SplineModel::felt(const ImuLink& imu, double t) const {
  const Vec3& lever = imu.T_body_imu.translation;
  const auto then = rotation_.evaluate<2>(t - imu.accel_lag_s);
  const auto position = position_.evaluate<2>(t - imu.accel_lag_s);
  const Vec3 force =
      then.rotation.conjugate() * (calibration_.board_scale * position.acceleration - calibration_.gravity_board) +
      calibration_.board_scale * (then.acceleration.cross(lever) + then.velocity.cross(then.velocity.cross(lever)));
  const Vec3 rate = imu.accel_lag_s == 0 ? then.velocity : rotation_.evaluate<1>(t).velocity;
  const Quat back = imu.T_body_imu.rotation.conjugate();
  return {back * rate, back * force};
}

SplineModel::Felt SplineModel::reading(const ImuLink& imu, double t) const {
  Felt out = felt(imu, t);
  if (imu.filtered()) {
    const Felt before = felt(imu, t - time_step_s), after = felt(imu, t + time_step_s);
    const Vec3 rate_bend = after.rate - 2 * out.rate + before.rate,
               force_bend = after.force - 2 * out.force + before.force;
    out.rate += imu.gyro_bend_s2 / (time_step_s * time_step_s) * rate_bend;
    out.force += imu.accel_bend_s2 / (time_step_s * time_step_s) * force_bend;
  }
  return {imu.gyro_matrix * out.rate, imu.accel_matrix * out.force};
}

/// All samples of a span share their control points. Their rows are stacked, and multiplied once.
void SplineModel::add_samples(const Span& span, const Weights& w, const BorderLayout& layout, ArrowSystem& system,
                              Sums& sums) const {
  const ImuSession& session = *imus_[span.imu];
  const ImuLink& link = calibration_.imus[span.imu];
  const BorderLayout::Imu& at = layout.imus[span.imu];
  const auto times = session.curve.times_s();
  const Vec3& gravity = calibration_.gravity_board;
  const double scale = calibration_.board_scale;
  const BiasCurve::Place bias = link.bias.at(0.5 * (times[span.first] + times[span.last - 1]));
  const Vec3 gyro_bias = link.bias.gyro(bias), accel_bias = link.bias.accel(bias);
  const std::size_t gyro_sort = this->gyro_sort(span.imu);
  const double root_gyro = std::sqrt(w[gyro_sort]), root_accel = std::sqrt(w[gyro_sort + 1]);
  const Vec3& lever = link.T_body_imu.translation;
  const bool aside = span.imu > 0;
  const bool in_time = at.offset >= 0 || at.response >= 0 || link.filtered();
  const Mat3 to_imu = link.T_body_imu.rotation.conjugate().toRotationMatrix();

  const double begin = link.body_time(times[span.first]) - begin_s_;
  const int band = band_size();
  Plan gyro, accel;
  for (int i = 0; i < order; ++i) gyro.take(knot_size * (knots_.locate(begin).first + i), 3);
  accel.take(knot_size * knots_.locate(begin - link.accel_lag_s).first, knot_size * order);
  accel.at.gravity = accel.take(band + layout.gravity, 4);
  for (int i = 0; i < BiasCurve::order; ++i) {
    const int place = band + at.bias + 6 * (bias.first + i);
    const int g = gyro.take(place, 3), a = accel.take(place + 3, 3);
    if (i == 0) gyro.at.bias = g, accel.at.bias = a;
  }
  for (Plan* plan : {&gyro, &accel}) {
    if (at.rotation >= 0) plan->at.rotation = plan->take(band + at.rotation, 3);
    if (at.offset >= 0) plan->at.offset = plan->take(band + at.offset, 1);
    if (at.drift >= 0) plan->at.drift = plan->take(band + at.drift, 1);
  }
  if (at.translation >= 0) accel.at.translation = accel.take(band + at.translation, 3);
  if (at.matrices >= 0) {
    gyro.at.matrix = gyro.take(band + at.matrices, 9);
    accel.at.matrix = accel.take(band + at.matrices + 9, 6);
  }
  if (at.response >= 0) {
    gyro.at.response = gyro.take(band + at.response, 1);
    accel.at.response = accel.take(band + at.response + 1, 2);
  }

  const auto n = static_cast<Eigen::Index>(span.last - span.first);
  Eigen::MatrixXd j_gyro = Eigen::MatrixXd::Zero(3 * n, gyro.at.size),
                  j_accel = Eigen::MatrixXd::Zero(3 * n, accel.at.size);
  Eigen::VectorXd white_gyro(3 * n), white_accel(3 * n);
  RotationSpline<order>::Jacobians jacobians;
  for (Eigen::Index s = 0; s < n; ++s) {
    const std::size_t sample = span.first + static_cast<std::size_t>(s);
    const double t = link.body_time(times[sample]) - begin_s_;
    auto g = j_gyro.middleRows<3>(3 * s);
    auto a = j_accel.middleRows<3>(3 * s);
    auto rotation = aside ? rotation_.evaluate<2>(t, jacobians) : rotation_.evaluate<1>(t, jacobians);
    const Mat3 to_gyro = root_gyro * link.gyro_matrix * to_imu, to_accel = root_accel * link.accel_matrix * to_imu;
    for (int i = 0; i < order; ++i)
      g.block<3, 3>(0, 3 * i).noalias() = to_gyro * jacobians.velocity[static_cast<std::size_t>(i)];
    Vec3 rate = to_imu * rotation.velocity;
    // Forces are those of a little earlier, where the accelerometer lags.
    const double then = t - link.accel_lag_s;
    if (link.accel_lag_s != 0)
      rotation = aside ? rotation_.evaluate<2>(then, jacobians) : rotation_.evaluate<1>(then, jacobians);
    const auto position = position_.evaluate<2>(then);
    const Mat3 back = rotation.rotation.conjugate().toRotationMatrix();
    const Vec3 body_force = back * (scale * position.acceleration - gravity);
    const Vec3& omega = rotation.velocity;
    Vec3 by_lever = Vec3::Zero();
    if (aside) by_lever = rotation.acceleration.cross(lever) + omega.cross(omega.cross(lever));
    Vec3 force = to_imu * (body_force + scale * by_lever);
    const Vec3 ideal_rate = rate, ideal_force = force;
    Vec3 rate_slope = Vec3::Zero(), force_slope = Vec3::Zero(), rate_bend = Vec3::Zero(), force_bend = Vec3::Zero();
    if (in_time) {
      const Felt before = felt(link, t - time_step_s), after = felt(link, t + time_step_s);
      rate_slope = (after.rate - before.rate) / (2 * time_step_s);
      force_slope = (after.force - before.force) / (2 * time_step_s);
      rate_bend = (after.rate - 2 * rate + before.rate) / (time_step_s * time_step_s);
      force_bend = (after.force - 2 * force + before.force) / (time_step_s * time_step_s);
      rate += link.gyro_bend_s2 * rate_bend;
      force += link.accel_bend_s2 * force_bend;
    }
    const Vec3 r_gyro = link.gyro_matrix * rate + gyro_bias - session.curve.gyro()[sample],
               r_accel = link.accel_matrix * force + accel_bias - session.curve.accel()[sample];
    white_gyro.segment<3>(3 * s) = root_gyro * r_gyro;
    white_accel.segment<3>(3 * s) = root_accel * r_accel;
    sums.squares[gyro_sort] += r_gyro.squaredNorm();
    sums.squares[gyro_sort + 1] += r_accel.squaredNorm();

    // The bend is a matter of a percent: its own dependence on the motion is left out of the derivatives.
    const Mat3 to_board = to_accel * back;
    const Mat3 by_rotation = to_accel * hat(body_force);
    Mat3 by_velocity = Mat3::Zero(), by_acceleration = Mat3::Zero();
    if (aside) {
      by_velocity = -scale * to_accel * (hat(omega.cross(lever)) + hat(omega) * hat(lever));
      by_acceleration = -scale * to_accel * hat(lever);
    }
    for (int i = 0; i < order; ++i) {
      const auto k = static_cast<std::size_t>(i);
      a.block<3, 3>(0, 6 * i).noalias() = by_rotation * jacobians.rotation[k];
      if (aside)
        a.block<3, 3>(0, 6 * i) += by_velocity * jacobians.velocity[k] + by_acceleration * jacobians.acceleration[k];
      a.block<3, 3>(0, 6 * i + 3) = (scale * position.weights.d2[i]) * to_board;
    }
    a.block<3, 3>(0, accel.at.gravity) = -to_board;
    a.col(accel.at.gravity + 3) = to_board * position.acceleration + to_accel * by_lever;
    for (int i = 0; i < BiasCurve::order; ++i) {
      g.block<3, 3>(0, gyro.at.bias + 3 * i).diagonal().setConstant(root_gyro * bias.w[i]);
      a.block<3, 3>(0, accel.at.bias + 3 * i).diagonal().setConstant(root_accel * bias.w[i]);
    }
    const Mat3 gyro_matrix = root_gyro * link.gyro_matrix, accel_matrix = root_accel * link.accel_matrix;
    if (at.rotation >= 0) {
      g.block<3, 3>(0, gyro.at.rotation) = gyro_matrix * hat(ideal_rate);
      a.block<3, 3>(0, accel.at.rotation) = accel_matrix * hat(ideal_force);
    }
    if (at.translation >= 0)
      a.block<3, 3>(0, accel.at.translation) =
          scale * to_accel * (hat(rotation.acceleration) + hat(omega) * hat(omega));
    if (at.offset >= 0) {
      g.col(gyro.at.offset) = gyro_matrix * rate_slope;
      a.col(accel.at.offset) = accel_matrix * force_slope;
    }
    if (at.drift >= 0) {
      g.col(gyro.at.drift) = (times[sample] - link.centre_s) * gyro_matrix * rate_slope;
      a.col(accel.at.drift) = (times[sample] - link.centre_s) * accel_matrix * force_slope;
    }
    if (at.matrices >= 0) {
      for (int row = 0; row < 3; ++row) g.block<1, 3>(row, gyro.at.matrix + 3 * row) = root_gyro * rate.transpose();
      for (int row = 0, next = accel.at.matrix; row < 3; ++row)
        for (int column = 0; column <= row; ++column) a(row, next++) = root_accel * force[column];
    }
    if (at.response >= 0) {
      g.col(gyro.at.response) = gyro_matrix * rate_bend;
      a.col(accel.at.response) = accel_matrix * force_bend;
      a.col(accel.at.response + 1) = -accel_matrix * force_slope;
    }
  }
  sums.count[gyro_sort] += 3 * static_cast<double>(n);
  sums.count[gyro_sort + 1] += 3 * static_cast<double>(n);
  system.accumulate_residual(gyro.blocks, j_gyro, white_gyro);
  system.accumulate_residual(accel.blocks, j_accel, white_accel);
}

}  // namespace takt::batch
