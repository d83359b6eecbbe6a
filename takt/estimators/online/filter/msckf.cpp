// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/filter/msckf.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "takt/motion/trajectory.h"

namespace takt::online {

namespace {

/// Clones kept for one camera, and for each further one.
constexpr std::size_t clones_of_first = 16, clones_of_others = 10;
constexpr std::size_t fewest_sightings = 3;
constexpr double extrinsic_turn_sigma = 5e-3, extrinsic_shift_sigma = 5e-3;
/// A followed corner's error persists from picture to picture, which its scatter does not show.
constexpr double measured_widened = 1.5;
constexpr double still_speed_sigma = 0.01;
/// Jacobians follow the estimate until the motion is known so well that its first estimates may stand for it.
constexpr double settled_after_s = 5;

/// Wilson and Hilferty's quantile of χ² at 3.1 σ: one good feature in a thousand is refused.
double most_squares(int rows) {
  const double n = rows, c = 2 / (9 * n), q = 1 - c + 3.09 * std::sqrt(c);
  return n * q * q * q;
}

}  // namespace

Msckf::Msckf(const TrackingRig& rig, const TrackingOptions& options)
    : rig_(rig), options_(options), noise_(imu_noise_of(rig)) {
  lay_out_state();
}

void Msckf::lay_out_state() {
  int at = motion_size;
  for (const TrackingCamera& c : rig_.cameras) {
    Camera out;
    out.rows = c.model.height;
    out.rows_to_middle = c.timing.row == RowReference::first ? 0.5 * (c.model.height - 1) : 0;
    out.given_line_delay_s = c.timing.line_delay_s();
    out.sigma_known = c.pixel_sigma.has_value();
    out.free_line_delay = options_.line_delay;
    out.at_offset = at++;
    out.at_drift = at++;
    if (out.free_line_delay) out.at_line_delay = at++;
    if (options_.refine_extrinsics) out.at_extrinsics = at, at += 6;
    if (options_.refine_intrinsics) out.at_intrinsics = at, at += 4;
    cameras_.push_back(out);
  }
  clones_begin_ = at;
  tracks_.resize(cameras_.size());
}

void Msckf::start(const FirstMotion& first) {
  t_s_ = t_started_s_ = first.t_s;
  now_ = first.motion;
  R_first_ = now_.R, p_first_ = now_.p, v_first_ = now_.v;
  clones_.clear();
  for (auto& of_camera : tracks_) of_camera.clear();
  step_watch_.clear();
  stepped_ = false;
  P_.setZero(clones_begin_, clones_begin_);
  P_.topLeftCorner<motion_size, motion_size>() = first.covariance;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    Camera& c = cameras_[i];
    const FirstMotion::Camera& from = first.cameras.at(i);
    c.offset_s = from.offset_s, c.drift = from.drift, c.line_delay_s = from.line_delay_s;
    c.extrinsics = from.extrinsics;
    c.pixel_sigma = from.pixel_sigma * (c.sigma_known ? 1 : measured_widened);
    c.intrinsics = from.intrinsics;
    P_(c.at_offset, c.at_offset) = from.offset_sigma_s * from.offset_sigma_s;
    const double drift_sigma = from.drift_sigma > 0 ? from.drift_sigma : 1e-6 * options_.drift_sigma_ppm;
    P_(c.at_drift, c.at_drift) = drift_sigma * drift_sigma;
    if (c.at_line_delay >= 0) P_(c.at_line_delay, c.at_line_delay) = from.line_delay_sigma_s * from.line_delay_sigma_s;
    if (c.at_extrinsics >= 0) {
      P_.diagonal().segment<3>(c.at_extrinsics).setConstant(extrinsic_turn_sigma * extrinsic_turn_sigma);
      P_.diagonal().segment<3>(c.at_extrinsics + 3).setConstant(extrinsic_shift_sigma * extrinsic_shift_sigma);
    }
    if (c.at_intrinsics >= 0)
      P_.diagonal().segment<4>(c.at_intrinsics).setConstant(intrinsics_sigma_px * intrinsics_sigma_px);
  }
}

FrameReport Msckf::observe(const BearingFrame& frame, const ImuHistory& imu) {
  FrameReport report;
  const Camera& c = cameras_[frame.camera];
  const double offset_s = c.offset_s + c.drift * (frame.t_s + c.offset_s - t_s_);
  const double t_s = frame.t_s + offset_s + (c.line_delay_s - c.given_line_delay_s) * c.rows_to_middle;
  report.t_imu_s = t_s_;
  if (!(t_s > t_s_)) return report;
  const double dt_s = t_s - t_s_;
  carry_to(t_s, imu);
  report.t_imu_s = t_s_, report.used = true;
  if (frame.still) {
    stand_still(dt_s, imu);
    return report;
  }
  clone(frame, imu);
  if (frame.observable)
    step_watch_.observe_slip(slip(frame, imu),
                             std::hypot(frame.stamp_sigma_s, std::sqrt(P_(c.at_offset, c.at_offset))));
  follow(frame);
  use_features(frame);
  report.doubt = step_watch_.doubt();
  while (clones_.size() >= most_clones()) forget_oldest_clone();
  report.stepped = std::exchange(stepped_, false);
  report.lost = !P_.diagonal().allFinite() || !now_.v.allFinite() || P_.diagonal().minCoeff() < 0 || misfit_ > 10;
  return report;
}

void Msckf::carry_to(double t_s, const ImuHistory& imu) {
  const double dt = t_s - t_s_;
  Transition by;
  propagate(now_, imu, t_s_, t_s, noise_, &by);
  // The attitude's column between first estimates, so that yaw and position stay unseen.
  const Vec3 g = gravity_world();
  const Mat3 R0 = R_first_.toRotationMatrix();
  by.transition.block<3, 3>(at_theta, at_theta) = now_.R.toRotationMatrix().transpose() * R0;
  by.transition.block<3, 3>(at_velocity, at_theta) = -hat(now_.v - v_first_ - dt * g) * R0;
  by.transition.block<3, 3>(at_position, at_theta) = -hat(now_.p - p_first_ - dt * v_first_ - 0.5 * dt * dt * g) * R0;
  R_first_ = now_.R, p_first_ = now_.p, v_first_ = now_.v;

  const Eigen::Index others = P_.rows() - motion_size;
  const Mat15 motion = by.transition * P_.topLeftCorner<motion_size, motion_size>() * by.transition.transpose();
  P_.topLeftCorner<motion_size, motion_size>() = 0.5 * (motion + motion.transpose()) + by.noise;
  P_.topRightCorner(motion_size, others) = (by.transition * P_.topRightCorner(motion_size, others)).eval();
  P_.bottomLeftCorner(others, motion_size) = P_.topRightCorner(motion_size, others).transpose();
  for (Camera& c : cameras_) {
    c.offset_s += dt * c.drift;
    P_.row(c.at_offset) += dt * P_.row(c.at_drift);
    P_.col(c.at_offset) += dt * P_.col(c.at_drift);
    P_(c.at_offset, c.at_offset) += dt * offset_walk * offset_walk;
    P_(c.at_drift, c.at_drift) += dt * drift_walk * drift_walk;
  }
  t_s_ = t_s;
}

void Msckf::clone(const BearingFrame& frame, const ImuHistory& imu) {
  const Camera& c = cameras_[frame.camera];
  Kept kept{next_clone_++, frame.camera, {now_.R, now_.R, now_.p, now_.p, {}}};
  if (c.line_delay_s != 0 || c.free_line_delay) {
    const double half_s = 0.5 * c.rows * std::max(std::abs(c.line_delay_s), c.free_line_delay ? 1e-4 : 0.0);
    kept.clone.readout = ReadoutMotion(imu, now_, t_s_, half_s);
  }
  const Eigen::Index old = P_.rows();
  P_.conservativeResize(old + 6, old + 6);
  // The clone's error is the pose's, and the pose's derivative times the error of the time it was taken at.
  Eigen::Matrix<double, 6, 1> derivative;
  derivative << imu.mean(t_s_, 0.004).gyro - now_.gyro_bias, now_.v;
  auto rows = P_.block(old, 0, 6, old);
  rows = P_.topLeftCorner(6, old);
  rows += derivative * P_.row(c.at_offset).head(old);
  if (c.at_line_delay >= 0) rows += (c.rows_to_middle * derivative) * P_.row(c.at_line_delay).head(old);
  P_.block(0, old, old, 6) = rows.transpose();
  Eigen::Matrix<double, 6, 6> corner = rows.leftCols<6>();
  corner += rows.col(c.at_offset) * derivative.transpose();
  if (c.at_line_delay >= 0) corner += rows.col(c.at_line_delay) * (c.rows_to_middle * derivative).transpose();
  corner += (frame.stamp_sigma_s * frame.stamp_sigma_s) * derivative * derivative.transpose();
  P_.bottomRightCorner<6, 6>() = 0.5 * (corner + corner.transpose());
  clones_.push_back(std::move(kept));
}

void Msckf::follow(const BearingFrame& frame) {
  auto& tracks = tracks_[frame.camera];
  const std::int64_t here = clones_.back().id;
  for (const SeenFeature& f : frame.features) {
    auto [known, is_new] = tracks.try_emplace(f.id);
    if (is_new) {
      // Tracks that began together would all end together: their first use is spread over the window.
      constexpr auto spread = static_cast<std::int64_t>(clones_of_first - 4);
      known->second.longest = 5 + static_cast<std::size_t>(((f.id * 7) % spread + spread) % spread);
    }
    known->second.seen.emplace_back(here, f.sighting);
    known->second.last = here;
  }
}

/// Of the frame that has just been cloned, by some of the points that were followed up to it.
FrameSlip Msckf::slip(const BearingFrame& frame, const ImuHistory& imu) const {
  constexpr std::size_t enough = 150, best_known = 5;
  const Camera& c = cameras_[frame.camera];
  const auto& tracks = tracks_[frame.camera];
  Eigen::Matrix<double, 6, 1> pose_per_s;
  pose_per_s << imu.mean(t_s_, 0.004).gyro - now_.gyro_bias, now_.v;
  FrameSlip slip;
  std::size_t used = 0;
  for (const SeenFeature& f : frame.features) {
    const auto track = tracks.find(f.id);
    if (track == tracks.end() || track->second.seen.size() < best_known) continue;
    Mat3 point;
    const auto landmark = triangulate(sightings(frame.camera, track->second), nullptr, &point);
    if (!landmark) continue;
    const auto o = online::observe(f.sighting, clones_.back().clone, c.extrinsics, c.line_delay_s, *landmark, false);
    if (!o) continue;
    slip.add(*o, pose_per_s, c.pixel_sigma, c.pixel_sigma * c.pixel_sigma * point);
    if (++used == enough) break;
  }
  return slip;
}

void Msckf::use_features(const BearingFrame& frame) {
  const std::int64_t here = clones_.back().id, oldest = clones_.front().id;
  const bool full = clones_.size() >= most_clones();
  Gathered all;
  all.H.resize(512, P_.rows() - motion_size);
  all.residual.resize(512);
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera)
    for (auto it = tracks_[camera].begin(); it != tracks_[camera].end();) {
      Track& track = it->second;
      const bool ended = camera == frame.camera && track.last != here;
      const bool due =
          track.seen.size() >= track.longest || (full && !track.seen.empty() && track.seen.front().first == oldest);
      if ((ended || due) && track.seen.size() >= fewest_sightings) gather(camera, track, all);
      if (ended) {
        it = tracks_[camera].erase(it);
        continue;
      }
      if (due) {
        track.seen.clear();
        track.longest = most_clones();
      }
      ++it;
    }
  if (all.rows > 0) correct(all, !frame.observable);
}

std::size_t Msckf::most_clones() const {
  return clones_of_first + clones_of_others * (cameras_.size() - 1);
}

int Msckf::place_of(std::int64_t clone_id) const {
  const auto at = std::lower_bound(clones_.begin(), clones_.end(), clone_id,
                                   [](const Kept& k, std::int64_t id) { return k.id < id; });
  return clones_begin_ + 6 * static_cast<int>(at - clones_.begin());
}

std::vector<SeenFrom> Msckf::sightings(std::size_t camera, const Track& track) const {
  const Camera& c = cameras_[camera];
  std::vector<SeenFrom> seen;
  for (const auto& [id, sighting] : track.seen) {
    const auto& kept = clones_[static_cast<std::size_t>((place_of(id) - clones_begin_) / 6)];
    seen.push_back({&sighting, &kept.clone, &c.extrinsics, c.line_delay_s});
  }
  return seen;
}

void Msckf::gather(std::size_t camera, const Track& track, Gathered& all) {
  const Camera& c = cameras_[camera];
  const std::vector<SeenFrom> seen = sightings(camera, track);
  std::vector<int> places;
  for (const auto& [id, sighting] : track.seen) places.push_back(place_of(id));
  const auto landmark = triangulate(seen);
  if (!landmark) return;

  // Columns: the camera's own, then its clones.
  std::vector<std::pair<int, int>> blocks;  // where in the state, how many
  const int own = (c.at_line_delay >= 0 ? 1 : 0) + (c.at_extrinsics >= 0 ? 6 : 0) + (c.at_intrinsics >= 0 ? 4 : 0);
  if (own > 0) blocks.emplace_back(c.at_drift + 1, own);
  for (const int place : places) blocks.emplace_back(place, 6);
  const int rows = 2 * static_cast<int>(seen.size()), columns = own + 6 * static_cast<int>(seen.size());
  Eigen::Matrix<double, Eigen::Dynamic, 3> to_landmark(rows, 3);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::VectorXd r(rows);
  const double scale = 1 / c.pixel_sigma;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const auto o = online::observe(*seen[k].sighting, *seen[k].clone, c.extrinsics, c.line_delay_s, *landmark, true);
    if (!o) return;
    const auto row = static_cast<Eigen::Index>(2 * k);
    r.segment<2>(row) = -scale * o->residual;
    to_landmark.middleRows<2>(row) = scale * o->landmark;
    H.block<2, 6>(row, own + 6 * static_cast<Eigen::Index>(k)) = scale * o->pose;
    if (c.at_line_delay >= 0) H.block<2, 1>(row, 0) = scale * o->line_delay;
    if (c.at_extrinsics >= 0) H.block<2, 6>(row, c.at_extrinsics - c.at_drift - 1) = scale * o->extrinsics;
    if (c.at_intrinsics >= 0) {
      const Mat2x4 by_intrinsics = to_intrinsics(*seen[k].sighting);
      H.block<2, 4>(row, c.at_intrinsics - c.at_drift - 1) = scale * by_intrinsics;
      r.segment<2>(row) -= scale * by_intrinsics * c.intrinsics;
    }
  }
  project_out(to_landmark, H, r);
  const auto free_H = H.bottomRows(rows - 3);
  const auto free_r = r.tail(rows - 3);
  const double squares = free_r.squaredNorm();
  const double most = most_squares(rows - 3);
  if (squares > most) {
    // The state's own uncertainty may explain it.
    Eigen::MatrixXd P_local(columns, columns);
    for (int i = 0, at_i = 0; i < static_cast<int>(blocks.size()); at_i += blocks[i].second, ++i)
      for (int j = 0, at_j = 0; j < static_cast<int>(blocks.size()); at_j += blocks[j].second, ++j)
        P_local.block(at_i, at_j, blocks[i].second, blocks[j].second) =
            P_.block(blocks[i].first, blocks[j].first, blocks[i].second, blocks[j].second);
    Eigen::MatrixXd S = free_H * P_local * free_H.transpose();
    S.diagonal().array() += 1;
    if (!(free_r.dot(S.llt().solve(free_r)) < most)) return;
  }
  const int more = rows - 3;
  if (all.rows + more > all.H.rows()) {
    all.H.conservativeResize(2 * all.H.rows(), Eigen::NoChange);
    all.residual.conservativeResize(2 * all.residual.size());
  }
  all.H.middleRows(all.rows, more).setZero();
  for (int i = 0, from = 0; i < static_cast<int>(blocks.size()); from += blocks[i].second, ++i)
    all.H.block(all.rows, blocks[i].first - motion_size, more, blocks[i].second) =
        free_H.middleCols(from, blocks[i].second);
  all.residual.segment(all.rows, more) = free_r;
  all.rows += more;
}

void Msckf::correct(const Gathered& all, bool hold_offsets) {
  // All rows in as few as there are columns: QR turns the rest into noise alone.
  const Eigen::Index n = P_.rows() - motion_size;
  Eigen::MatrixXd H = all.H.topRows(all.rows);
  Eigen::VectorXd r = all.residual.head(all.rows);
  const double squares = r.squaredNorm();
  if (all.rows > n) {
    const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(H);
    r.applyOnTheLeft(qr.householderQ().adjoint());
    r.conservativeResize(n);
    H = Eigen::MatrixXd(H.topRows(n).triangularView<Eigen::Upper>());
  }
  const Eigen::Index rank = H.rows();

  Eigen::MatrixXd PHt(P_.rows(), rank);
  PHt.noalias() = P_.rightCols(n) * H.transpose();
  Eigen::MatrixXd S(rank, rank);
  S.noalias() = H * PHt.bottomRows(n);
  S.diagonal().array() += 1;
  const Eigen::LLT<Eigen::MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return;
  const Eigen::VectorXd weighted = llt.solve(r);
  // ‖r‖² over all rows less what the state explains: χ² of the innovation.
  const double chi2 = squares - r.squaredNorm() + r.dot(weighted);
  const double share = std::clamp(chi2 / static_cast<double>(all.rows), 0.0, 100.0);
  for (Camera& c : cameras_)
    if (!c.sigma_known)
      c.pixel_sigma *= 1 + 0.01 * (std::clamp(share * measured_widened * measured_widened, 0.3, 3.0) - 1);
  misfit_ += 0.05 * (share - misfit_);

  const int watched = cameras_.front().at_offset;
  const double variance_before = P_(watched, watched);
  Eigen::VectorXd error = PHt * weighted;
  if (hold_offsets) {
    // The offsets keep their values and their variance, as Schmidt's filter has it [Schmidt1966].
    Eigen::MatrixXd K = llt.solve(PHt.transpose()).transpose();
    for (const Camera& c : cameras_)
      for (const int at : {c.at_offset, c.at_drift}) K.row(at).setZero(), error[at] = 0;
    const Eigen::MatrixXd KPHt = K * PHt.transpose();
    P_ += K * S * K.transpose() - KPHt - KPHt.transpose();
  } else {
    // P −= (P·Hᵀ·L⁻ᵀ)·(…)ᵀ
    Eigen::MatrixXd W = PHt.transpose();
    llt.matrixL().solveInPlace(W);
    P_.selfadjointView<Eigen::Lower>().rankUpdate(W.transpose(), -1);
    P_.triangularView<Eigen::StrictlyUpper>() = P_.transpose();
    stepped_ = step_watch_.observe(error[watched], variance_before, P_(watched, watched)) || stepped_;
  }
  move_state(error);
}

void Msckf::stand_still(double dt_s, const ImuHistory& imu) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(9, P_.rows());
  Eigen::VectorXd r(9), variance(9);
  const double half = 0.5 * std::min(dt_s, 0.2);
  const Reading mean = imu.mean(t_s_ - half, half);
  const Vec3 up = R_first_.conjugate() * -gravity_world();
  H.block<3, 3>(0, at_velocity).setIdentity();
  r.head<3>() = -now_.v;
  H.block<3, 3>(3, at_gyro_bias).setIdentity();
  r.segment<3>(3) = mean.gyro - now_.gyro_bias;
  H.block<3, 3>(6, at_theta) = hat(up);
  H.block<3, 3>(6, at_accel_bias).setIdentity();
  r.tail<3>() = mean.accel - now_.accel_bias - now_.R.conjugate() * -gravity_world();
  const double span = std::max(2 * half, 1e-3);
  variance.head<3>().setConstant(still_speed_sigma * still_speed_sigma);
  variance.segment<3>(3).setConstant(noise_.gyro_density * noise_.gyro_density / span + 1e-8);
  variance.tail<3>().setConstant(noise_.accel_density * noise_.accel_density / span + 1e-5);
  correct_dense(H, r, variance);
}

void Msckf::correct_dense(const Eigen::MatrixXd& H, const Eigen::VectorXd& r, const Eigen::VectorXd& variance) {
  const Eigen::MatrixXd PHt = P_ * H.transpose();
  Eigen::MatrixXd S = H * PHt;
  S.diagonal() += variance;
  const Eigen::LLT<Eigen::MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return;
  // A rig that moves after all is not forced to stand.
  if (r.dot(llt.solve(r)) > 2 * most_squares(static_cast<int>(r.size()))) return;
  const Eigen::VectorXd error = PHt * llt.solve(r);
  Eigen::MatrixXd W = PHt.transpose();
  llt.matrixL().solveInPlace(W);
  P_.selfadjointView<Eigen::Lower>().rankUpdate(W.transpose(), -1);
  P_.triangularView<Eigen::StrictlyUpper>() = P_.transpose();
  move_state(error);
}

void Msckf::move_state(const Eigen::VectorXd& error) {
  now_.add(error.head<motion_size>());
  for (Camera& c : cameras_) {
    c.offset_s += error[c.at_offset];
    c.drift += error[c.at_drift];
    if (c.at_line_delay >= 0) c.line_delay_s += error[c.at_line_delay];
    if (c.at_extrinsics >= 0) {
      c.extrinsics.R_imu_cam = c.extrinsics.R_imu_cam * exp_so3(error.segment<3>(c.at_extrinsics)).toRotationMatrix();
      c.extrinsics.p_imu_cam += error.segment<3>(c.at_extrinsics + 3);
    }
    if (c.at_intrinsics >= 0) c.intrinsics += error.segment<4>(c.at_intrinsics);
  }
  Eigen::Index at = clones_begin_;
  for (Kept& k : clones_) {
    k.clone.R = (k.clone.R * exp_so3(error.segment<3>(at))).normalized();
    k.clone.p += error.segment<3>(at + 3);
    at += 6;
  }
  if (t_s_ - t_started_s_ < settled_after_s) {
    R_first_ = now_.R, p_first_ = now_.p, v_first_ = now_.v;
    for (Kept& k : clones_) k.clone.R_first = k.clone.R, k.clone.p_first = k.clone.p;
  }
}

void Msckf::forget_oldest_clone() {
  const std::int64_t gone = clones_.front().id;
  clones_.pop_front();
  for (auto& of_camera : tracks_)
    for (auto& [id, track] : of_camera) std::erase_if(track.seen, [gone](const auto& s) { return s.first == gone; });
  const Eigen::Index from = clones_begin_ + 6, rest = P_.rows() - from;
  P_.block(clones_begin_, 0, rest, P_.cols()) = P_.block(from, 0, rest, P_.cols()).eval();
  P_.block(0, clones_begin_, P_.rows(), rest) = P_.block(0, from, P_.rows(), rest).eval();
  P_.conservativeResize(P_.rows() - 6, P_.cols() - 6);
}

OffsetBelief Msckf::belief(std::size_t camera) const {
  const Camera& c = cameras_[camera];
  OffsetBelief b;
  b.line_delay_s = c.line_delay_s;
  if (c.at_line_delay >= 0) b.line_delay_sigma_s = std::sqrt(P_(c.at_line_delay, c.at_line_delay));
  b.extrinsics = c.extrinsics;
  // Intrinsics serve the offset only: they also take up what one triangulation of noisy points leaves, which no sigma
  // of theirs knows of. The window tells them.
  b.intrinsics = c.intrinsics;
  if (c.at_extrinsics >= 0) {
    b.turn_sigma = P_.diagonal().segment<3>(c.at_extrinsics).cwiseSqrt();
    b.shift_sigma = P_.diagonal().segment<3>(c.at_extrinsics + 3).cwiseSqrt();
  }
  believe({c.offset_s, c.drift, P_(c.at_offset, c.at_offset), P_(c.at_offset, c.at_drift), P_(c.at_drift, c.at_drift)},
          1e-6 * options_.drift_sigma_ppm, b);
  return b;
}

}  // namespace takt::online
