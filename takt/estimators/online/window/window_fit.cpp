// SPDX-License-Identifier: Apache-2.0
// How the window is fitted: sliding_window.cpp has what comes into it and what leaves it.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "takt/estimators/online/window/sliding_window.h"
#include "takt/estimators/online/window/window_system.h"

namespace takt::online {

namespace {

constexpr int most_iterations = 4;
constexpr double huber = 2.5;  ///< σ
constexpr double still_speed_sigma = 0.01, still_gyro_sigma = 1e-3;
constexpr double recentre_s = 5e-4;

Vec15 difference(const Motion& a, const Motion& b) {
  Vec15 d;
  d << log_so3(b.R.conjugate() * a.R), a.p - b.p, a.v - b.v, a.gyro_bias - b.gyro_bias, a.accel_bias - b.accel_bias;
  return d;
}

}  // namespace

/// Before anything has become a prior, states still can be moved to where their frames are now believed to be.
void SlidingWindow::recentre(const ImuHistory& imu) {
  if (marginalised_ || options_.feature_velocity) return;
  double furthest = 0;
  for (const State& s : states_)
    for (const Shot& shot : s.shots)
      furthest = std::max(furthest, std::abs(shift_of(s, shot) - s.clocks[shot.camera].slip_s));
  if (furthest < recentre_s) return;
  for (std::size_t i = 1; i < states_.size(); ++i) {
    State& s = states_[i];
    if (s.shots.empty()) continue;
    const double t_s = s.t_s + shift_of(s, s.shots.front()) - s.clocks[s.shots.front().camera].slip_s;
    if (t_s <= states_[i - 1].t_s || std::min(t_s, s.t_s) < imu.begin_s() || t_s > imu.end_s()) continue;
    s.motion = carried(s.motion, imu, s.t_s, t_s);
    s.t_s = t_s;
    s.rate = imu.mean(t_s, 0.004).gyro;
    for (Shot& shot : s.shots)
      if (!shot.readout.empty())
        shot.readout = ReadoutMotion(
            imu, s.motion, t_s,
            0.5 * cameras_[shot.camera].rows * std::max(std::abs(cameras_[shot.camera].line_delay_s), 1e-6));
  }
  for (std::size_t i = 0; i + 1 < states_.size(); ++i)
    states_[i].to_next.emplace(imu, states_[i].t_s, states_[i + 1].t_s, states_[i].motion, noise_);
}

void SlidingWindow::relink(const ImuHistory& imu) {
  for (std::size_t i = 0; i + 1 < states_.size(); ++i) {
    State& s = states_[i];
    if (s.to_next && s.to_next->stale(s.motion) && imu.begin_s() <= s.t_s)
      s.to_next.emplace(imu, s.t_s, states_[i + 1].t_s, s.motion, noise_);
  }
}

void SlidingWindow::solve(const ImuHistory& imu) {
  recentre(imu);
  relink(imu);
  choose_tracks();
  Normals here = assemble();
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const Eigen::LLT<Eigen::MatrixXd> llt(here.H);
    if (llt.info() != Eigen::Success) break;
    const double gained = descend(-llt.solve(here.g), here);
    if (gained < 0.05 + 1e-3 * here.squares) break;
  }
  if (here.freedom > 30) {
    const double share = std::clamp(here.squares / here.freedom, 0.0, 100.0);
    misfit_ += 0.1 * (share - misfit_);
    for (Camera& c : cameras_)
      if (!c.sigma_known)
        c.pixel_sigma = std::clamp(c.pixel_sigma * std::sqrt(1 + 0.1 * (std::min(share, 4.0) - 1)), 0.05, 3.0);
  }
  drop_strangers();
  learn_beliefs(here);
}

/// Goes along `step`, or less far where the fit becomes worse; what the cost falls by. Shorter steps and no damping of
/// the diagonal, which would hold fast what the links between states leave to all of them in common: the offset.
double SlidingWindow::descend(const Eigen::VectorXd& step, Normals& here) {
  const Snapshot before{states_, cameras_, tracks_};
  for (const double share : {1.0, 0.3, 0.1}) {
    move(share * step);
    Normals there = assemble();
    const double gained = here.cost - there.cost;
    if (gained > 0) {
      here = std::move(there);
      return gained;
    }
    states_ = before.states, cameras_ = before.cameras, tracks_ = before.tracks;
  }
  return 0;
}

SlidingWindow::Normals SlidingWindow::assemble() {
  Normals n;
  n.H.setZero(size(), size());
  n.g.setZero(size());
  add_prior(n);
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (states_[i].to_next) add_link(i, n);
    add_slips(i, n);
    if (states_[i].still) add_stillness(i, n);
  }
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera)
    for (auto& [id, track] : tracks_[camera])
      if (track.active) add_track(camera, track, n);
  return n;
}

Eigen::VectorXd SlidingWindow::deviation() const {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(size());
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const Camera &c = cameras_[i], &from = cameras_at_prior_[i];
    if (c.at_line_delay >= 0) d[c.at_line_delay] = c.line_delay_s - from.line_delay_s;
    if (c.at_extrinsics >= 0) {
      d.segment<3>(c.at_extrinsics) =
          log_so3(Quat(Mat3(from.extrinsics.R_imu_cam.transpose() * c.extrinsics.R_imu_cam)).normalized());
      d.segment<3>(c.at_extrinsics + 3) = c.extrinsics.p_imu_cam - from.extrinsics.p_imu_cam;
    }
    if (c.at_intrinsics >= 0) d.segment<4>(c.at_intrinsics) = c.intrinsics - from.intrinsics;
  }
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const State& s = states_[i];
    const int at = at_state(i);
    d.segment<motion_size>(at) = difference(s.motion, s.at_prior);
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      const int k = at + motion_size + clock_size * static_cast<int>(c);
      d[k + at_offset] = (s.clocks[c].offset_s - s.clocks_at_prior[c].offset_s) / ms;
      d[k + at_drift] = (s.clocks[c].drift - s.clocks_at_prior[c].drift) / ppm;
      d[k + at_slip] = (s.clocks[c].slip_s - s.clocks_at_prior[c].slip_s) / ms;
    }
  }
  return d;
}

void SlidingWindow::add_prior(Normals& n) const {
  const Eigen::VectorXd d = deviation();
  const Eigen::VectorXd Hd = prior_.H * d;
  n.H += prior_.H;
  n.g += prior_.g + Hd;
  n.cost += 0.5 * d.dot(Hd) + prior_.g.dot(d);
}

void SlidingWindow::add_link(std::size_t i, Normals& n) const {
  const State &a = states_[i], &b = states_[i + 1];
  const ImuLink& link = *a.to_next;
  const int at_a = at_state(i), at_b = at_state(i + 1);
  const Vec15 r = link.residual(a.motion, b.motion);
  const auto j = link.jacobians(a.motion, b.motion);
  const Vec15 wr = link.information() * r;
  const Mat15 w_from = link.information() * j.to_from, w_to = link.information() * j.to_to;
  n.H.block<motion_size, motion_size>(at_a, at_a).noalias() += j.to_from.transpose() * w_from;
  n.H.block<motion_size, motion_size>(at_b, at_b).noalias() += j.to_to.transpose() * w_to;
  const Mat15 cross = j.to_from.transpose() * w_to;
  n.H.block<motion_size, motion_size>(at_a, at_b) += cross;
  n.H.block<motion_size, motion_size>(at_b, at_a) += cross.transpose();
  n.g.segment<motion_size>(at_a).noalias() += j.to_from.transpose() * wr;
  n.g.segment<motion_size>(at_b).noalias() += j.to_to.transpose() * wr;
  n.cost += 0.5 * r.dot(wr);

  const double dt = link.duration_s();
  const double w_offset = 1 / (dt * squared(offset_walk / ms) + 1e-12),
               w_drift = 1 / (dt * squared(drift_walk / ppm) + 1e-12);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const int ka = at_a + motion_size + clock_size * static_cast<int>(c), kb = ka + at_b - at_a;
    const Clock &from = a.clocks[c], &to = b.clocks[c];
    const double r_offset = (to.offset_s - from.offset_s - dt * from.drift) / ms,
                 r_drift = (to.drift - from.drift) / ppm;
    const int at[] = {ka + at_offset, ka + at_drift, kb + at_offset};
    const double slope[] = {-1, -dt * ppm / ms, 1};
    for (int p = 0; p < 3; ++p) {
      n.g[at[p]] += w_offset * slope[p] * r_offset;
      for (int q = 0; q < 3; ++q) n.H(at[p], at[q]) += w_offset * slope[p] * slope[q];
    }
    const int da = ka + at_drift, db = kb + at_drift;
    n.H(da, da) += w_drift, n.H(db, db) += w_drift;
    n.H(da, db) -= w_drift, n.H(db, da) -= w_drift;
    n.g[da] -= w_drift * r_drift, n.g[db] += w_drift * r_drift;
    n.cost += 0.5 * (w_offset * squared(r_offset) + w_drift * squared(r_drift));
  }
}

void SlidingWindow::add_slips(std::size_t i, Normals& n) const {
  const State& s = states_[i];
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    double sigma_s = 1e-6;  // where the stamp has no error of its own the variable rests
    for (const Shot& shot : s.shots)
      if (shot.camera == c && shot.stamp_sigma_s > 0) sigma_s = shot.stamp_sigma_s;
    const int at = at_state(i) + motion_size + clock_size * static_cast<int>(c) + at_slip;
    const double w = squared(ms / sigma_s), slip = s.clocks[c].slip_s / ms;
    n.H(at, at) += w, n.g[at] += w * slip, n.cost += 0.5 * w * slip * slip;
  }
}

void SlidingWindow::add_stillness(std::size_t i, Normals& n) const {
  const State& s = states_[i];
  const auto add = [&](int at, const Vec3& r, double sigma) {
    const double w = 1 / squared(sigma);
    n.H.diagonal().segment<3>(at_state(i) + at).array() += w;
    n.g.segment<3>(at_state(i) + at) += w * r;
    n.cost += 0.5 * w * r.squaredNorm();
  };
  add(at_velocity, s.motion.v, still_speed_sigma);
  add(at_gyro_bias, s.motion.gyro_bias - s.rate, std::max(still_gyro_sigma, noise_.gyro_density / std::sqrt(0.008)));
}

bool SlidingWindow::add_track(std::size_t camera, Track& track, Normals& n) const {
  const Camera& c = cameras_[camera];
  constexpr int per_sighting = 8;  // pose, offset, slip
  const int own = (c.at_line_delay >= 0 ? 1 : 0) + (c.at_extrinsics >= 0 ? 6 : 0) + (c.at_intrinsics >= 0 ? 4 : 0);
  const int first_own = c.at_line_delay >= 0   ? c.at_line_delay
                        : c.at_extrinsics >= 0 ? c.at_extrinsics
                                               : c.at_intrinsics;
  const int columns = own + per_sighting * static_cast<int>(track.seen.size());
  auto& e = track.elimination;
  e.columns.resize(static_cast<std::size_t>(columns));
  for (int i = 0; i < own; ++i) e.columns[static_cast<std::size_t>(i)] = first_own + i;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(columns);
  Mat3 H_ll = Mat3::Zero();
  Vec3 g_l = Vec3::Zero();
  Eigen::Matrix<double, 3, Eigen::Dynamic> H_lx = Eigen::Matrix<double, 3, Eigen::Dynamic>::Zero(3, columns);
  double cost = 0, squares = 0;
  const double scale = 1 / c.pixel_sigma;
  for (std::size_t k = 0; k < track.seen.size(); ++k) {
    const Seen& seen = track.seen[k];
    const auto [i, shot] = find(seen.shot);
    const State& s = states_[i];
    const int at = own + per_sighting * static_cast<int>(k);
    for (int q = 0; q < 6; ++q) e.columns[static_cast<std::size_t>(at + q)] = at_state(i) + q;
    const int clock = at_state(i) + motion_size + clock_size * static_cast<int>(camera);
    e.columns[static_cast<std::size_t>(at + 6)] = clock + at_offset;
    e.columns[static_cast<std::size_t>(at + 7)] = clock + at_slip;

    const Clone clone = clone_of(s, *shot);
    const auto o = online::observe(seen.sighting, clone, c.extrinsics, c.line_delay_s, track.landmark, false);
    if (!o) {
      n.cost += 20;  // as bad as an outlier
      track.active = false;
      return false;
    }
    Vec2 r = o->residual;
    Eigen::Matrix<double, 6, 1> derivative;
    derivative << s.rate - s.motion.gyro_bias, s.motion.v;
    Vec2 by_time = o->pose * derivative;
    if (options_.feature_velocity) {
      by_time = seen.velocity;
      r += shift_of(s, *shot) * seen.velocity;
    }
    const Mat2x4 by_intrinsics = to_intrinsics(seen.sighting);
    if (c.at_intrinsics >= 0) r += by_intrinsics * c.intrinsics;
    r *= scale;
    const double length = r.norm();
    const double weight = length > huber ? huber / length : 1;
    cost += length > huber ? huber * (length - 0.5 * huber) : 0.5 * length * length;
    squares += weight * length * length;

    Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, 11> J_own(2, own);
    if (c.at_line_delay >= 0) J_own.col(0) = scale * (o->line_delay + c.rows_to_middle * by_time);
    if (c.at_extrinsics >= 0) J_own.middleCols<6>(c.at_extrinsics - first_own) = scale * o->extrinsics;
    if (c.at_intrinsics >= 0) J_own.middleCols<4>(c.at_intrinsics - first_own) = scale * by_intrinsics;
    Eigen::Matrix<double, 2, per_sighting> J;
    J.leftCols<6>() = scale * o->pose;
    J.col(6) = (scale * ms) * by_time;
    J.col(7).setZero();
    if (shot->stamp_sigma_s > 0) J.col(7) = J.col(6);
    const Mat2x3 L = scale * o->landmark;
    H_ll.noalias() += weight * L.transpose() * L;
    g_l.noalias() += weight * L.transpose() * r;
    H_lx.middleCols<per_sighting>(at).noalias() += weight * L.transpose() * J;
    H.block<per_sighting, per_sighting>(at, at).noalias() += weight * J.transpose() * J;
    g.segment<per_sighting>(at).noalias() += weight * J.transpose() * r;
    if (own > 0) {
      H_lx.leftCols(own).noalias() += weight * L.transpose() * J_own;
      H.topLeftCorner(own, own).noalias() += weight * J_own.transpose() * J_own;
      H.block(0, at, own, per_sighting).noalias() += weight * J_own.transpose() * J;
      g.head(own).noalias() += weight * J_own.transpose() * r;
    }
  }
  H.bottomLeftCorner(columns - own, own) = H.topRightCorner(own, columns - own).transpose();
  H_ll.diagonal().array() += 1e-9 * H_ll.trace() + 1e-12;
  const Mat3 inverse = H_ll.inverse();
  e.gain.noalias() = inverse * H_lx;
  e.lead = inverse * g_l;
  e.covariance = inverse;
  H.noalias() -= H_lx.transpose() * e.gain;
  g.noalias() -= H_lx.transpose() * e.lead;
  for (int q = 0; q < columns; ++q) {
    const int to = e.columns[static_cast<std::size_t>(q)];
    n.g[to] += g[q];
    for (int p = 0; p < columns; ++p) n.H(e.columns[static_cast<std::size_t>(p)], to) += H(p, q);
  }
  n.cost += cost, n.squares += squares;
  n.freedom += 2.0 * static_cast<double>(track.seen.size()) - 3;
  return true;
}

void SlidingWindow::move(const Eigen::VectorXd& step) {
  for (Camera& c : cameras_) {
    if (c.at_line_delay >= 0) c.line_delay_s += step[c.at_line_delay];
    if (c.at_extrinsics >= 0) {
      c.extrinsics.R_imu_cam = c.extrinsics.R_imu_cam * exp_so3(step.segment<3>(c.at_extrinsics)).toRotationMatrix();
      c.extrinsics.p_imu_cam += step.segment<3>(c.at_extrinsics + 3);
    }
    if (c.at_intrinsics >= 0) c.intrinsics += step.segment<4>(c.at_intrinsics);
  }
  for (std::size_t i = 0; i < states_.size(); ++i) {
    State& s = states_[i];
    s.motion.add(step.segment<motion_size>(at_state(i)));
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      const int at = at_state(i) + motion_size + clock_size * static_cast<int>(c);
      s.clocks[c].offset_s += ms * step[at + at_offset];
      s.clocks[c].drift += ppm * step[at + at_drift];
      s.clocks[c].slip_s += ms * step[at + at_slip];
    }
  }
  for (auto& of_camera : tracks_)
    for (auto& [id, track] : of_camera) {
      if (!track.active) continue;
      const Elimination& e = track.elimination;
      Eigen::VectorXd local(static_cast<Eigen::Index>(e.columns.size()));
      for (std::size_t q = 0; q < e.columns.size(); ++q) local[static_cast<Eigen::Index>(q)] = step[e.columns[q]];
      const Vec3 by = -e.lead - e.gain * local;
      Landmark& l = track.landmark;
      l.direction = (l.direction + tangents(l.direction) * by.head<2>()).normalized();
      l.inverse_distance += by[2];
    }
}

/// A track that fits far worse than noise allows is no point of the world.
void SlidingWindow::drop_strangers() {
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    const Camera& c = cameras_[camera];
    for (auto it = tracks_[camera].begin(); it != tracks_[camera].end();) {
      Track& track = it->second;
      bool stranger = false;
      if (track.active) {
        double squares = 0;
        for (const Seen& seen : track.seen) {
          const auto [i, shot] = find(seen.shot);
          const auto r =
              residual(seen.sighting, clone_of(states_[i], *shot), c.extrinsics, c.line_delay_s, track.landmark);
          squares += r ? r->squaredNorm() / squared(c.pixel_sigma) : 1e3;
        }
        const double freedom = 2.0 * static_cast<double>(track.seen.size()) - 3;
        stranger = squares > most_squares(freedom) * std::max(1.0, misfit_);
      }
      it = stranger ? tracks_[camera].erase(it) : std::next(it);
    }
  }
}

void SlidingWindow::learn_beliefs(const Normals& normals) {
  const Eigen::LLT<Eigen::MatrixXd> llt(normals.H);
  broken_ = llt.info() != Eigen::Success || !states_.back().motion.v.allFinite();
  if (broken_) return;
  const int newest = at_state(states_.size() - 1) + motion_size;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const int at = newest + clock_size * static_cast<int>(i);
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(size(), 2);
    unit(at + at_offset, 0) = 1, unit(at + at_drift, 1) = 1;
    const Eigen::MatrixXd columns = llt.solve(unit);
    const Clock& k = states_.back().clocks[i];
    covariances_[i] = {k.offset_s, k.drift, ms * ms * columns(at + at_offset, 0), ms * ppm * columns(at + at_drift, 0),
                       ppm * ppm * columns(at + at_drift, 1)};
  }
  // The border stands first.
  const Eigen::MatrixXd columns = llt.solve(Eigen::MatrixXd::Identity(size(), border_));
  const Eigen::VectorXd sigma = columns.topRows(border_).diagonal().cwiseSqrt();
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const Camera& c = cameras_[i];
    if (c.at_line_delay >= 0) beliefs_[i].line_delay_sigma_s = sigma[c.at_line_delay];
    if (c.at_extrinsics >= 0) {
      beliefs_[i].turn_sigma = sigma.segment<3>(c.at_extrinsics);
      beliefs_[i].shift_sigma = sigma.segment<3>(c.at_extrinsics + 3);
    }
    if (c.at_intrinsics >= 0) beliefs_[i].intrinsics_sigma = sigma.segment<4>(c.at_intrinsics);
  }
}

}  // namespace takt::online
