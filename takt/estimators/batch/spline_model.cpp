// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/spline_model.h"

#include <algorithm>
#include <cmath>

#include "takt/math/parallel.h"

namespace takt::batch {

namespace {

/// The spline reaches this far beyond the outermost frames (s): room for offset, line delay and jitter to move.
constexpr double margin_s = 0.04;
/// Stiffness that only a stretch without any measurement feels.
constexpr double stiff_rad_s2 = 1e4, stiff_m_s2 = 1e3;

}  // namespace

SplineModel::SplineModel(const Rig& rig, const MotionStart& start, const SplineOptions& options)
    : cameras_(rig.cameras), imus_(rig.imus), options_(options), calibration_(start.calibration) {
  for (const CameraSession* camera : cameras_) noise_.cameras.push_back({camera->poses.corner_sigma_px, 0});
  for (const ImuSession* imu : imus_) noise_.imus.push_back(imu->high_pass);
  free_.camera_drift.assign(cameras_.size(), options.drift);
  free_.line_delay = options.line_delay;
  free_.line_delay.resize(cameras_.size(), false);
  free_.imu_drift.assign(imus_.size(), options.drift);
  free_.matrices.assign(imus_.size(), false);
  free_.response.assign(imus_.size(), false);
  take_frames(start);
  double first = start.anchors.front().time_s, last = first;
  for (const SplineFrame& f : frames_)
    for (const double row : {0.0, f.bands.front().mean_row, f.bands.back().mean_row}) {
      const double t = calibration_.cameras[f.camera].imu_time(f.time_s, row);
      first = std::min(first, t), last = std::max(last, t);
    }
  begin_s_ = first - margin_s;
  knots_ = UniformKnots<order>::covering(last - first + 2 * margin_s, options.knot_interval_s);
  start_motion(start);
  take_intervals();
  take_samples();
  layout_ = lay_out(free_);
}

void SplineModel::start_motion(const MotionStart& start) {
  const auto& anchors = start.anchors;
  const ImuCurve& curve = imus_[0]->curve;
  const BiasCurve& biases = start.calibration.imus[0].bias;
  const int n = knots_.control_points();
  std::vector<Quat> rotations(static_cast<std::size_t>(n));
  Eigen::Matrix3Xd positions(3, n);
  std::size_t k = 0;
  for (int i = 0; i < n; ++i) {
    // A control point acts most in the middle of its Order segments.
    const double t = begin_s_ + (i - 0.5 * (order - 2)) * knots_.interval_s();
    while (k + 1 < anchors.size() && anchors[k + 1].time_s <= t) ++k;
    const BodyState& s = anchors[k].state;
    const double from = anchors[k].time_s, dt = t - from;
    const BiasCurve::Place bias = biases.at(from);
    Quat R;
    Vec3 p;
    const bool last = k + 1 == anchors.size();
    if (dt >= 0 && !last && anchors[k + 1].time_s - from <= longest_join_s && curve.covers(from, t)) {
      const Preintegrated step = preintegrate(curve, from, t, biases.gyro(bias), biases.accel(bias), {1, 1});
      const double scale = start.calibration.board_scale;
      R = s.R_board_imu * step.rotation;
      p = s.position + dt * s.velocity +
          (0.5 * dt * dt * start.calibration.gravity_board + s.R_board_imu * step.position) / scale;
    } else if (dt >= 0 && !last) {  // across a gap
      const BodyState& next = anchors[k + 1].state;
      const double share = dt / (anchors[k + 1].time_s - from);
      R = s.R_board_imu.slerp(share, next.R_board_imu);
      p = (1 - share) * s.position + share * next.position;
    } else {  // beyond the ends
      const double reach = std::clamp(dt, -margin_s, margin_s);
      const Vec3 omega = curve.covers(from, from) ? Vec3(curve.at(from).gyro - biases.gyro(bias)) : Vec3(Vec3::Zero());
      R = s.R_board_imu * exp_so3(reach * omega);
      p = s.position + reach * s.velocity;
    }
    rotations[static_cast<std::size_t>(i)] = R.normalized();
    positions.col(i) = p;
  }
  // A spline of order 6 smooths its control points: value = c + ¼·c'' (second difference). Undone to first order.
  static_assert(order == 6);
  std::vector<Quat> sharp = rotations;
  Eigen::Matrix3Xd sharp_positions = positions;
  for (int i = 1; i + 1 < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3 bend =
        log_so3(rotations[at].conjugate() * rotations[at + 1]) - log_so3(rotations[at - 1].conjugate() * rotations[at]);
    sharp[at] = rotations[at] * exp_so3(-0.25 * bend);
    sharp_positions.col(i) -= 0.25 * (positions.col(i + 1) - 2 * positions.col(i) + positions.col(i - 1));
  }
  rotation_ = RotationSpline<order>(knots_.interval_s(), std::move(sharp));
  position_ = EuclideanSpline<3, order>(knots_.interval_s(), std::move(sharp_positions));
}

BorderLayout SplineModel::lay_out(const Freedom& free) const {
  BorderLayout out;
  int next = 0;
  const auto take = [&next](int count) {
    const int at = next;
    next += count;
    return at;
  };
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    BorderLayout::Camera at;
    at.rotation = take(3), at.translation = take(3), at.offset = take(1);
    if (free.camera_drift[c]) at.drift = take(1);
    if (free.line_delay[c]) at.line_delay = take(1);
    out.cameras.push_back(at);
  }
  out.gravity = take(3), out.board_scale = take(1);
  for (std::size_t m = 0; m < imus_.size(); ++m) {
    BorderLayout::Imu at;
    if (m > 0) {
      at.rotation = take(3), at.translation = take(3), at.offset = take(1);
      if (free.imu_drift[m]) at.drift = take(1);
    }
    if (free.matrices[m]) at.matrices = take(BorderLayout::matrices_size);
    if (free.response[m]) at.response = take(BorderLayout::response_size);
    at.bias = take(6 * calibration_.imus[m].bias.points());
    out.imus.push_back(at);
  }
  out.size = next;
  return out;
}

SplineModel::Weights SplineModel::weights() const {
  Weights w;
  for (const CameraNoise& n : noise_.cameras) w.push_back(1 / (n.corner_px * n.corner_px));
  for (std::size_t m = 0; m < imus_.size(); ++m) {
    const double dt = imus_[m]->curve.median_step_s();
    w.push_back(dt / (noise_.imus[m].gyro * noise_.imus[m].gyro));
    w.push_back(dt / (noise_.imus[m].accel * noise_.imus[m].accel));
  }
  return w;
}

void SplineModel::add_stiffness(ArrowSystem& system) const {
  const double h2 = knots_.interval_s() * knots_.interval_s();
  const double w_r = 1 / (stiff_rad_s2 * stiff_rad_s2 * h2 * h2), w_p = 1 / (stiff_m_s2 * stiff_m_s2 * h2 * h2);
  const auto& points = rotation_.control_points();
  const auto& places = position_.control_points();
  Eigen::Matrix<double, 18, 18> h = Eigen::Matrix<double, 18, 18>::Zero();
  constexpr double bend[3] = {1, -2, 1};
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      h.block<3, 3>(6 * a, 6 * b).diagonal().setConstant(w_r * bend[a] * bend[b]);
      h.block<3, 3>(6 * a + 3, 6 * b + 3).diagonal().setConstant(w_p * bend[a] * bend[b]);
    }
  for (int i = 1; i + 1 < knots_.control_points(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3 turn =
        log_so3(points[at].conjugate() * points[at + 1]) - log_so3(points[at - 1].conjugate() * points[at]);
    const Vec3 shift = places.col(i + 1) - 2 * places.col(i) + places.col(i - 1);
    Eigen::Matrix<double, 18, 1> g;
    for (int a = 0; a < 3; ++a) {
      g.segment<3>(6 * a) = w_r * bend[a] * turn;
      g.segment<3>(6 * a + 3) = w_p * bend[a] * shift;
    }
    const ArrowSystem::Block block[] = {{knot_size * (i - 1), 18}};
    system.accumulate(block, h, g);
  }
}

ArrowSystem SplineModel::normal_equations(const Weights& w, const BorderLayout& layout, Sums& sums) const {
  const int reach = knots_of_a_frame();
  // Always two parts, so that the sum is the same for any number of threads.
  std::vector<ArrowSystem> parts;
  for (int part = 0; part < 2; ++part) parts.emplace_back(band_size(), knot_size * reach - 1, layout.size);
  const std::vector<double> zeros(sorts(), 0);
  Sums part_sums[2] = {{zeros, zeros}, {zeros, zeros}};
  parallel_for(2, options_.threads, [&](int part) {
    const auto share = [part](std::size_t n, int of) { return n * static_cast<std::size_t>(part + of) / 2; };
    for (std::size_t i = share(frames_.size(), 0); i < share(frames_.size(), 1); ++i)
      add_frame(frames_[i], w, layout, parts[static_cast<std::size_t>(part)], part_sums[part]);
    for (std::size_t i = share(samples_.size(), 0); i < share(samples_.size(), 1); ++i)
      add_samples(samples_[i], w, layout, parts[static_cast<std::size_t>(part)], part_sums[part]);
  });
  sums = part_sums[0];
  for (std::size_t g = 0; g < sorts(); ++g)
    sums.squares[g] += part_sums[1].squares[g], sums.count[g] += part_sums[1].count[g];
  parts[0].add(parts[1]);
  add_stiffness(parts[0]);
  add_priors(calibration_, layout, band_size(), parts[0]);
  return std::move(parts[0]);
}

}  // namespace takt::batch
