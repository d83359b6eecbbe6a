// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/discrete_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "takt/math/parallel.h"

namespace takt::batch {

namespace {

/// Frames of a stretch at most: its system then stays in the cache.
constexpr std::size_t longest_stretch = 128;

/// Unknowns that act everywhere, at the head of the border; in a stretch's own border the biases that act follow, then
/// the states of its first and of its last frame.
constexpr int camera_at = 0, offset_at = 6, gravity_at = 8, scale_at = 11, global_size = 12;
constexpr int bias_size = 6 * BiasCurve::order;
constexpr int stretch_border = global_size + bias_size + 2 * state_size;
/// Columns of a join's Jacobian.
constexpr int biases = 24;

}  // namespace

BorderLayout discrete_layout(int bias_points) {
  BorderLayout at;
  at.cameras = {{.rotation = camera_at, .translation = camera_at + 3, .offset = offset_at, .drift = offset_at + 1}};
  at.gravity = gravity_at;
  at.board_scale = scale_at;
  at.imus = {{.bias = global_size}};
  at.size = global_size + 6 * bias_points;
  return at;
}

Vec6 pose_error(const DiscreteFit& fit, std::size_t k) {
  const BodyState& s = fit.states[k];
  const Rigid T_board_cam = Rigid{s.R_board_imu, s.position} * fit.calibration.cameras[0].T_imu_cam;
  const Rigid predicted = T_board_cam.inverse(), &seen = fit.chain[k].view->T_cam_board;
  const Quat turn = predicted.rotation * seen.rotation.conjugate();
  Vec6 xi;
  xi << predicted.translation - turn * seen.translation, log_so3(turn);
  return xi;
}

int DiscreteSystem::Stretch::state(std::size_t k) const {
  if (k == first) return band() + global_size + bias_size;
  if (k == last) return band() + global_size + bias_size + state_size;
  return state_size * static_cast<int>(k - first - 1);
}

DiscreteSystem::DiscreteSystem(const DiscreteFit& fit, const ImuCurve& imu, int threads)
    : fit_(fit), imu_(imu), threads_(threads), joins_(fit.chain.size()) {
  cut();
  parallel_for(static_cast<int>(stretches_.size()), threads_, [&](int i) {
    const Stretch& at = stretches_[static_cast<std::size_t>(i)];
    for (std::size_t k = at.first; k < at.last; ++k)
      if (fit_.chain[k].joined) joins_[k] = linearise(k);
  });
}

double DiscreteSystem::imu_time(std::size_t k) const {
  return fit_.calibration.cameras[0].imu_time(fit_.chain[k].time_s, fit_.chain[k].mean_row);
}

BiasCurve::Place DiscreteSystem::bias_of_join(std::size_t k) const {
  return fit_.calibration.imus[0].bias.at(0.5 * (imu_time(k) + imu_time(k + 1)));
}

void DiscreteSystem::cut() {
  for (std::size_t k = 0; k + 1 < fit_.chain.size(); ++k) {
    const int points = bias_of_join(k).first;
    if (stretches_.empty() || points != stretches_.back().bias_first || k - stretches_.back().first >= longest_stretch)
      stretches_.push_back({k, k, points});
    stretches_.back().last = k + 1;
  }
}

DiscreteSystem::Join DiscreteSystem::linearise(std::size_t k) const {
  const CameraLink& link = fit_.calibration.cameras[0];
  const BiasCurve& bias = fit_.calibration.imus[0].bias;
  const BodyState &a = fit_.states[k], &b = fit_.states[k + 1];
  const double t0 = imu_time(k), t1 = imu_time(k + 1), dt = t1 - t0;
  Join out;
  out.bias = bias_of_join(k);
  const Preintegrated p = preintegrate(imu_, t0, t1, bias.gyro(out.bias), bias.accel(out.bias), fit_.noise.imus[0]);
  const Vec3& g = fit_.calibration.gravity_board;
  const Mat3 back = a.R_board_imu.conjugate().toRotationMatrix();
  const Quat turn = a.R_board_imu.conjugate() * b.R_board_imu;
  const double scale = fit_.calibration.board_scale;
  const Vec3 speeding = b.velocity - a.velocity, going = b.position - a.position - dt * a.velocity;
  const Vec3 dv = back * (scale * speeding - dt * g);
  const Vec3 dp = back * (scale * going - 0.5 * dt * dt * g);
  Vec9 r;
  r << log_so3(p.rotation.conjugate() * turn), dv - p.velocity, dp - p.position;
  const Mat3 unwind = right_jacobian_inverse(r.head<3>());
  const Mat3 unwind_left = -unwind.transpose();

  // Columns: state k, state k+1 | offset, drift | gravity | scale | the biases there
  constexpr int next = 9, offset = 18, drift = 19, gravity = 20, board_scale = 23;
  Eigen::Matrix<double, 9, columns>& j = out.jacobian;
  j.setZero();
  j.block<3, 3>(0, 0) = -unwind * turn.conjugate().toRotationMatrix();
  j.block<3, 3>(3, 0) = hat(dv);
  j.block<3, 3>(6, 0) = hat(dp);
  j.block<3, 3>(6, 3) = -scale * back;
  j.block<3, 3>(3, 6) = -scale * back;
  j.block<3, 3>(6, 6) = -scale * dt * back;
  j.block<3, 3>(0, next) = unwind;
  j.block<3, 3>(6, next + 3) = scale * back;
  j.block<3, 3>(3, next + 6) = scale * back;
  j.block<3, 3>(3, gravity) = -dt * back;
  j.block<3, 3>(6, gravity) = -0.5 * dt * dt * back;
  j.block<3, 1>(3, board_scale) = back * speeding;
  j.block<3, 1>(6, board_scale) = back * going;
  const auto slides = [&](const Preintegrated::Change& c) {
    Vec9 d;
    d << unwind_left * c.rotation, -c.velocity, -c.position;
    return d;
  };
  const Vec9 start = slides(p.to_start), end = slides(p.to_end);
  j.col(offset) = start + end;
  const double c0 = fit_.chain[k].time_s - link.centre_s, c1 = fit_.chain[k + 1].time_s - link.centre_s;
  Vec9 longer;  // Δt grows with the drift
  longer << Vec3::Zero(), -back * g, -back * (scale * a.velocity + dt * g);
  j.col(drift) = c0 * start + c1 * end + (c1 - c0) * longer;
  j.block<3, 3>(0, biases) = unwind_left * p.rotation_to_gyro;
  j.block<3, 3>(3, biases) = -p.velocity_to_gyro;
  j.block<3, 3>(6, biases) = -p.position_to_gyro;
  j.block<3, 3>(3, biases + 3) = -p.velocity_to_accel;
  j.block<3, 3>(6, biases + 3) = -p.position_to_accel;

  const Eigen::LLT<Mat9> factor(p.covariance);
  out.residual = factor.matrixL().solve(r);
  factor.matrixL().solveInPlace(j);
  return out;
}

void DiscreteSystem::add_view(std::size_t k, const Stretch& at, const SortWeights& weight, ArrowSystem& system,
                              ResidualSums& sums) const {
  const CameraLink& link = fit_.calibration.cameras[0];
  const BodyState& s = fit_.states[k];
  const Mat3 R_cam_imu = link.T_imu_cam.rotation.conjugate().toRotationMatrix();
  const Mat3 R_cam_board = R_cam_imu * s.R_board_imu.conjugate().toRotationMatrix();
  Eigen::Matrix<double, 6, 12> j = Eigen::Matrix<double, 6, 12>::Zero();
  j.block<3, 3>(0, 0) = R_cam_imu * hat(link.T_imu_cam.translation);
  j.block<3, 3>(3, 0) = -R_cam_imu;
  j.block<3, 3>(0, 3) = -R_cam_board;
  j.block<3, 3>(3, 6).diagonal().setConstant(-1);  // camera's rotation
  j.block<3, 3>(0, 9) = -R_cam_imu;                // camera's place
  const Vec6 xi = pose_error(fit_, k);
  const double noise = fit_.noise.cameras[0].corner_px;
  const Mat6 information = fit_.chain[k].view->information / (noise * noise);
  sums.squares[camera_sort] += xi.dot(information * xi);
  sums.count[camera_sort] += 6;
  const Eigen::Matrix<double, 12, 6> jw = weight[camera_sort] * j.transpose() * information;
  const ArrowSystem::Block blocks[] = {{at.state(k), 6}, {at.band() + camera_at, 6}};
  system.accumulate(blocks, jw * j, jw * xi);
}

void DiscreteSystem::add_join(std::size_t k, const Stretch& at, const SortWeights& weight, ArrowSystem& system,
                              ResidualSums& sums) const {
  const BiasCurve::Place& bias = joins_[k].bias;
  Eigen::Matrix<double, 9, columns> j = joins_[k].jacobian;
  Vec9 r = joins_[k].residual;
  sums.squares[rotation_sort] += r.head<3>().squaredNorm();
  sums.squares[translation_sort] += r.tail<6>().squaredNorm();
  sums.count[rotation_sort] += 3;
  sums.count[translation_sort] += 6;
  const double w_r = std::sqrt(weight[rotation_sort]), w_t = std::sqrt(weight[translation_sort]);
  j.topRows<3>() *= w_r, r.head<3>() *= w_r;
  j.bottomRows<6>() *= w_t, r.tail<6>() *= w_t;

  // The biases are weighted means of three control points.
  constexpr int spread = biases + bias_size;
  const Eigen::Matrix<double, columns, columns> h = j.transpose() * j;
  const Eigen::Matrix<double, columns, 1> gradient = j.transpose() * r;
  Eigen::Matrix<double, spread, spread> h_points;
  Eigen::Matrix<double, spread, 1> g_points;
  h_points.topLeftCorner<biases, biases>() = h.topLeftCorner<biases, biases>();
  g_points.head<biases>() = gradient.head<biases>();
  for (int i = 0; i < BiasCurve::order; ++i) {
    const int column = biases + 6 * i;
    h_points.block<biases, 6>(0, column) = bias.w[i] * h.topRightCorner<biases, 6>();
    h_points.block<6, biases>(column, 0) = bias.w[i] * h.bottomLeftCorner<6, biases>();
    for (int l = 0; l < BiasCurve::order; ++l)
      h_points.block<6, 6>(column, biases + 6 * l) = bias.w[i] * bias.w[l] * h.bottomRightCorner<6, 6>();
    g_points.segment<6>(column) = bias.w[i] * gradient.tail<6>();
  }
  const ArrowSystem::Block blocks[] = {{at.state(k), state_size},
                                       {at.state(k + 1), state_size},
                                       {at.band() + offset_at, global_size - offset_at},
                                       {at.band() + global_size, bias_size}};
  system.accumulate(blocks, h_points, g_points);
}

ArrowSystem::Elimination DiscreteSystem::eliminate(std::size_t stretch, const SortWeights& weight,
                                                   ResidualSums& sums) const {
  const Stretch& at = stretches_[stretch];
  ArrowSystem system(at.band(), 2 * state_size - 1, stretch_border);
  for (std::size_t k = at.first; k < at.last; ++k) {
    add_view(k, at, weight, system, sums);
    if (fit_.chain[k].joined) add_join(k, at, weight, system, sums);
  }
  if (stretch + 1 == stretches_.size()) add_view(at.last, at, weight, system, sums);
  return std::move(system).eliminate();
}

std::array<ArrowSystem::Block, 3> DiscreteSystem::places(std::size_t stretch, int kept) const {
  const int bias = fit_.layout.imus[0].bias + 6 * stretches_[stretch].bias_first;
  return {{{kept, global_size}, {kept + bias, bias_size}, {state_size * static_cast<int>(stretch), 2 * state_size}}};
}

DiscreteStep DiscreteSystem::solve(const SortWeights& weight) const {
  const auto count = static_cast<int>(stretches_.size());
  std::vector<ArrowSystem::Elimination> eliminated(stretches_.size());
  std::vector<ResidualSums> sums(stretches_.size());
  parallel_for(count, threads_, [&](int i) {
    const auto s = static_cast<std::size_t>(i);
    eliminated[s] = eliminate(s, weight, sums[s]);
  });

  // What is left are the frames at the cuts and the border; summed in order, for any number of threads.
  DiscreteStep out;
  const int kept = state_size * (count + 1);
  ArrowSystem system(kept, 2 * state_size - 1, fit_.layout.size);
  for (std::size_t s = 0; s < eliminated.size(); ++s) {
    if (!eliminated[s].ok()) return out;
    system.accumulate(places(s, kept), eliminated[s]);
    for (int g = 0; g < residual_sorts; ++g) {
      out.sums.squares[g] += sums[s].squares[g];
      out.sums.count[g] += sums[s].count[g];
    }
  }
  add_priors(fit_.calibration, fit_.layout, kept, system);
  const ArrowSystem::Solution solution = std::move(system).solve();
  if (!solution.ok()) return out;
  out.ok = true;
  out.border = solution.step().tail(fit_.layout.size);
  out.covariance = solution.border_covariance();
  out.log_determinant = solution.log_determinant();
  out.states = all_states(eliminated, solution.step());
  return out;
}

Eigen::VectorXd DiscreteSystem::all_states(const std::vector<ArrowSystem::Elimination>& eliminated,
                                           const Eigen::VectorXd& kept_step) const {
  const int kept = state_size * static_cast<int>(stretches_.size() + 1);
  Eigen::VectorXd states(state_size * static_cast<Eigen::Index>(fit_.chain.size()));
  for (std::size_t s = 0; s < stretches_.size(); ++s) {
    const Stretch& at = stretches_[s];
    Eigen::Matrix<double, stretch_border, 1> shared;
    int row = 0;
    for (const ArrowSystem::Block& b : places(s, kept)) {
      shared.segment(row, b.size) = kept_step.segment(b.first, b.size);
      row += b.size;
    }
    const auto first = state_size * static_cast<Eigen::Index>(at.first);
    states.segment<state_size>(first) = shared.segment<state_size>(global_size + bias_size);
    states.segment(first + state_size, at.band()) = eliminated[s].band_step(shared);
    states.segment<state_size>(state_size * static_cast<Eigen::Index>(at.last)) = shared.tail<state_size>();
  }
  return states;
}

}  // namespace takt::batch
