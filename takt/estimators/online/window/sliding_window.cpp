// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/window/sliding_window.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "takt/motion/trajectory.h"

namespace takt::online {

namespace {

constexpr std::size_t window_states = 12;
/// A camera's frames closer than this to its one before are passed over: the window shall span a second. Unless the rig
/// turns so fast that points would be lost before they have been seen often enough.
constexpr double least_spacing_s = 0.07, most_turn_rad = 0.12;
/// Another camera's frame so near to a state is its; else it gets a state of its own.
constexpr double same_instant_s = 0.005;
constexpr std::size_t fewest_sightings = 3, most_active = 70;
constexpr int most_iterations = 4;
constexpr double huber = 2.5;  ///< σ
constexpr double extrinsic_turn_sigma = 5e-3, extrinsic_shift_sigma = 5e-3;
constexpr double still_speed_sigma = 0.01, still_gyro_sigma = 1e-3;
constexpr double recentre_s = 5e-4;
/// A frame of a motion that does not tell the offset is fitted as if its stamp might be off by this.
constexpr double unheeded_stamp_s = 0.05;

/// Offsets in ms and drifts in ppm inside the system, so that its entries are of like size.
constexpr double ms = 1e-3, ppm = 1e-6;
enum ClockError { at_offset = 0, at_drift = 1, at_slip = 2 };
constexpr int clock_size = 3;

double squared(double x) {
  return x * x;
}

/// Wilson and Hilferty's quantile of χ² at 4 σ.
double most_squares(double n) {
  const double c = 2 / (9 * n), q = 1 - c + 4 * std::sqrt(c);
  return n * q * q * q;
}

Vec15 difference(const Motion& a, const Motion& b) {
  Vec15 d;
  d << log_so3(b.R.conjugate() * a.R), a.p - b.p, a.v - b.v, a.gyro_bias - b.gyro_bias, a.accel_bias - b.accel_bias;
  return d;
}

}  // namespace

SlidingWindow::SlidingWindow(const TrackingRig& rig, const TrackingOptions& options)
    : rig_(rig), options_(options), noise_(imu_noise_of(rig)) {
  lay_out();
}

void SlidingWindow::lay_out() {
  for (const TrackingCamera& from : rig_.cameras) {
    Camera c;
    c.rows = from.model.height;
    c.rows_to_middle = from.timing.row == RowReference::first ? 0.5 * (from.model.height - 1) : 0;
    c.given_line_delay_s = from.timing.line_delay_s();
    c.pixel_sigma = from.pixel_sigma.value_or(1);
    c.sigma_known = from.pixel_sigma.has_value();
    c.free_line_delay = options_.line_delay;
    if (c.free_line_delay) c.at_line_delay = border_++;
    if (options_.refine_extrinsics) c.at_extrinsics = border_, border_ += 6;
    if (options_.refine_intrinsics) c.at_intrinsics = border_, border_ += 4;
    cameras_.push_back(c);
  }
  tracks_.resize(cameras_.size());
  beliefs_.resize(cameras_.size());
  covariances_.resize(cameras_.size());
}

void SlidingWindow::start(const FirstMotion& first) {
  states_.clear();
  for (auto& of_camera : tracks_) of_camera.clear();
  step_watch_.clear();
  last_taken_s_.assign(cameras_.size(), -std::numeric_limits<double>::infinity());
  fitted_ = 0, marginalised_ = false, broken_ = false, stepped_ = false, misfit_ = 1;

  State s;
  s.t_s = first.t_s;
  s.motion = s.at_prior = first.motion;
  prior_.H.setZero(border_ + state_size(), border_ + state_size());
  prior_.g.setZero(border_ + state_size());
  prior_.H.block<motion_size, motion_size>(border_, border_) = first.covariance.llt().solve(Mat15::Identity());
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    Camera& c = cameras_[i];
    const FirstMotion::Camera& from = first.cameras.at(i);
    c.extrinsics = from.extrinsics;
    c.line_delay_s = from.line_delay_s;
    c.intrinsics = from.intrinsics;
    s.clocks.push_back({from.offset_s, from.drift, 0});
    const int at = border_ + motion_size + clock_size * static_cast<int>(i);
    prior_.H(at + at_offset, at + at_offset) = squared(ms / from.offset_sigma_s);
    const double drift_sigma = from.drift_sigma > 0 ? from.drift_sigma : ppm * options_.drift_sigma_ppm;
    prior_.H(at + at_drift, at + at_drift) = squared(ppm / drift_sigma);
    auto diagonal = prior_.H.diagonal();
    if (c.at_line_delay >= 0) diagonal[c.at_line_delay] = squared(1 / std::max(from.line_delay_sigma_s, 1e-9));
    if (c.at_extrinsics >= 0) {
      diagonal.segment<3>(c.at_extrinsics).setConstant(squared(1 / extrinsic_turn_sigma));
      diagonal.segment<3>(c.at_extrinsics + 3).setConstant(squared(1 / extrinsic_shift_sigma));
    }
    if (c.at_intrinsics >= 0) diagonal.segment<4>(c.at_intrinsics).setConstant(squared(1 / intrinsics_sigma_px));
    covariances_[i] = {from.offset_s, from.drift, squared(from.offset_sigma_s), 0, squared(drift_sigma)};
    beliefs_[i] = {};
    beliefs_[i].offset_s = from.offset_s, beliefs_[i].sigma_s = from.offset_sigma_s;
    beliefs_[i].line_delay_s = from.line_delay_s, beliefs_[i].line_delay_sigma_s = from.line_delay_sigma_s;
    beliefs_[i].extrinsics = from.extrinsics;
  }
  s.clocks_at_prior = s.clocks;
  cameras_at_prior_ = cameras_;
  states_.push_back(std::move(s));
}

FrameReport SlidingWindow::observe(const BearingFrame& frame, const ImuHistory& imu) {
  FrameReport report;
  const Camera& c = cameras_[frame.camera];
  const auto time_of = [&](const State& s) {
    const Clock& k = s.clocks[frame.camera];
    const double offset_s = k.offset_s + k.drift * (frame.t_s + k.offset_s - s.t_s);
    return frame.t_s + offset_s + (c.line_delay_s - c.given_line_delay_s) * c.rows_to_middle;
  };
  const double t_s = time_of(states_.back());
  report.t_imu_s = states_.back().t_s;
  const double dt_s = t_s - states_.back().t_s;
  const auto taken = [&](const Shot& shot) { return shot.camera == frame.camera; };
  const bool joins = std::abs(dt_s) < same_instant_s && std::ranges::none_of(states_.back().shots, taken);
  double& last_taken_s = last_taken_s_[frame.camera];
  if (!joins && !(dt_s > 0)) return report;
  if (frame.t_s - last_taken_s < least_spacing_s && !turned_far(t_s, imu)) return report;
  last_taken_s = frame.t_s;
  if (!joins) add_state(t_s, imu);
  report.used = true;
  report.t_imu_s = states_.back().t_s;
  const double before_s = states_.back().clocks.front().offset_s;
  const OffsetAndDrift& known = covariances_.front();
  const double variance_before =
      known.offset_variance +
      (joins ? 0 : 2 * dt_s * known.covariance + dt_s * dt_s * known.drift_variance + dt_s * squared(offset_walk));
  if (frame.still) {
    states_.back().still = true;
  } else {
    add_shot(frame, imu);
    if (frame.observable)
      step_watch_.observe_slip(slip(frame),
                               std::hypot(frame.stamp_sigma_s, std::sqrt(covariances_[frame.camera].offset_variance)));
    follow(frame);
  }
  solve(imu);
  ++fitted_;
  if (states_.back().still && states_.size() > 2 && states_[states_.size() - 2].still) {
    marginalise(states_.size() - 2);
  } else {
    while (states_.size() > window_states) marginalise(0);
  }
  if (frame.observable && !frame.still)
    stepped_ = step_watch_.observe(states_.back().clocks.front().offset_s - before_s, variance_before,
                                   covariances_.front().offset_variance);
  report.doubt = step_watch_.doubt();
  report.stepped = std::exchange(stepped_, false);
  report.lost = broken_ || misfit_ > 10;
  return report;
}

/// Since the newest state.
bool SlidingWindow::turned_far(double t_s, const ImuHistory& imu) const {
  const State& from = states_.back();
  if (!(t_s > from.t_s)) return false;
  return log_so3(increment(imu, from.t_s, t_s, from.motion.gyro_bias, from.motion.accel_bias).dR).norm() >
         most_turn_rad;
}

void SlidingWindow::add_state(double t_s, const ImuHistory& imu) {
  State& from = states_.back();
  State s;
  s.t_s = t_s;
  s.motion = from.motion;
  propagate(s.motion, imu, from.t_s, t_s, noise_, nullptr);
  s.clocks = from.clocks;
  for (Clock& k : s.clocks) k.offset_s += (t_s - from.t_s) * k.drift, k.slip_s = 0;
  s.at_prior = s.motion, s.clocks_at_prior = s.clocks;
  s.rate = imu.mean(t_s, 0.004).gyro;
  from.to_next.emplace(imu, from.t_s, t_s, from.motion, noise_);
  states_.push_back(std::move(s));
  prior_.H.conservativeResizeLike(Eigen::MatrixXd::Zero(size(), size()));
  prior_.g.conservativeResizeLike(Eigen::VectorXd::Zero(size()));
}

void SlidingWindow::add_shot(const BearingFrame& frame, const ImuHistory& imu) {
  const Camera& c = cameras_[frame.camera];
  State& s = states_.back();
  const double stamp_sigma_s =
      frame.observable ? frame.stamp_sigma_s : std::hypot(frame.stamp_sigma_s, unheeded_stamp_s);
  Shot shot{next_shot_++, frame.camera, frame.t_s, stamp_sigma_s, {}};
  if (c.line_delay_s != 0 || c.free_line_delay) {
    const double half_s = 0.5 * c.rows * std::max(std::abs(c.line_delay_s), c.free_line_delay ? 1e-4 : 0.0);
    shot.readout = ReadoutMotion(imu, s.motion, s.t_s, half_s);
  }
  s.shots.push_back(std::move(shot));
}

/// Of the newest frame, before anything is fitted to it.
FrameSlip SlidingWindow::slip(const BearingFrame& frame) const {
  const Camera& c = cameras_[frame.camera];
  const State& s = states_.back();
  Eigen::Matrix<double, 6, 1> pose_per_s;
  pose_per_s << s.rate - s.motion.gyro_bias, s.motion.v;
  const Clone clone = clone_of(s, s.shots.back());
  FrameSlip slip;
  for (const SeenFeature& f : frame.features) {
    const auto track = tracks_[frame.camera].find(f.id);
    if (track == tracks_[frame.camera].end() || !track->second.active) continue;
    const auto o = online::observe(f.sighting, clone, c.extrinsics, c.line_delay_s, track->second.landmark, false);
    if (o) slip.add(*o, pose_per_s, c.pixel_sigma, track->second.elimination.covariance);
  }
  return slip;
}

void SlidingWindow::follow(const BearingFrame& frame) {
  auto& tracks = tracks_[frame.camera];
  const std::int64_t here = next_shot_ - 1;
  for (const SeenFeature& f : frame.features) {
    auto [known, is_new] = tracks.try_emplace(f.id);
    Track& track = known->second;
    // Tracks that all began together would all end together: their beginnings are spread over the window.
    if (is_new && fitted_ == 0) track.wait = static_cast<std::size_t>(((f.id * 7) % 9 + 9) % 9);
    if (track.wait > 0) {
      --track.wait;
      continue;
    }
    Seen now{here, frame.t_s, f.sighting, Vec2::Zero()};
    if (!track.seen.empty()) {
      Seen& before = track.seen.back();
      const double dt_s = frame.t_s - before.t_s;
      before.velocity = before.sighting.misfit * now.sighting.bearing / dt_s;
      now.velocity = -(now.sighting.misfit * before.sighting.bearing) / dt_s;
    }
    track.seen.push_back(std::move(now));
  }
  std::vector<std::int64_t> there;
  for (const SeenFeature& f : frame.features) there.push_back(f.id);
  std::ranges::sort(there);
  for (auto it = tracks.begin(); it != tracks.end();) {
    if (!std::ranges::binary_search(there, it->first)) it->second.ended = true;
    const bool useless = it->second.ended && it->second.seen.size() < fewest_sightings;
    it = useless ? tracks.erase(it) : std::next(it);
  }
}

std::pair<std::size_t, const SlidingWindow::Shot*> SlidingWindow::find(std::int64_t id) const {
  for (std::size_t i = states_.size(); i-- > 0;)
    for (const Shot& shot : states_[i].shots)
      if (shot.id == id) return {i, &shot};
  return {0, nullptr};
}

/// Seconds from a state to when the frame was really taken, as now believed.
double SlidingWindow::shift_of(const State& s, const Shot& shot) const {
  const Camera& c = cameras_[shot.camera];
  const Clock& k = s.clocks[shot.camera];
  return shot.t_s + k.offset_s + k.slip_s + (c.line_delay_s - c.given_line_delay_s) * c.rows_to_middle - s.t_s;
}

Clone SlidingWindow::clone_of(const State& s, const Shot& shot) const {
  const double shift_s = options_.feature_velocity ? 0 : shift_of(s, shot);
  const Quat R = s.motion.R * exp_so3(shift_s * (s.rate - s.motion.gyro_bias));
  const Vec3 p = s.motion.p + shift_s * s.motion.v;
  return {R, R, p, p, shot.readout};
}

std::optional<Landmark> SlidingWindow::triangulated(std::size_t camera, const Track& track) const {
  std::vector<Clone> clones;
  clones.reserve(track.seen.size());
  std::vector<SeenFrom> seen;
  const Camera& c = cameras_[camera];
  for (const Seen& s : track.seen) {
    const auto [i, shot] = find(s.shot);
    clones.push_back(clone_of(states_[i], *shot));
    seen.push_back({&s.sighting, &clones.back(), &c.extrinsics, c.line_delay_s});
  }
  return triangulate(seen);
}

void SlidingWindow::choose_tracks() {
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    std::size_t active = 0;
    for (const auto& [id, track] : tracks_[camera]) active += track.active;
    for (auto& [id, track] : tracks_[camera]) {
      if (track.active || track.seen.size() < fewest_sightings + 1 || active >= most_active) continue;
      const auto landmark = triangulated(camera, track);
      if (!landmark) continue;
      track.landmark = *landmark;
      track.active = true, ++active;
    }
  }
}

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

void SlidingWindow::marginalise(std::size_t gone) {
  // Everything that speaks of the state, as it is now.
  Normals n;
  n.H.setZero(size(), size());
  n.g.setZero(size());
  add_prior(n);
  for (const std::size_t i : {gone - 1, gone}) {
    if (i >= states_.size() || !states_[i].to_next) continue;
    add_link(i, n);
  }
  add_slips(gone, n);
  if (states_[gone].still) add_stillness(gone, n);
  std::vector<std::int64_t> shots;
  for (const Shot& shot : states_[gone].shots) shots.push_back(shot.id);
  const auto leaves = [&](const Seen& s) { return std::ranges::find(shots, s.shot) != shots.end(); };
  for (std::size_t camera = 0; camera < cameras_.size() && !shots.empty(); ++camera)
    for (auto it = tracks_[camera].begin(); it != tracks_[camera].end();) {
      Track& track = it->second;
      if (std::ranges::none_of(track.seen, leaves)) {
        ++it;
        continue;
      }
      bool known = track.active;
      if (!known && track.seen.size() >= fewest_sightings) {
        if (const auto landmark = triangulated(camera, track)) track.landmark = *landmark, known = true;
        // Never fitted, so judged here.
        if (known) {
          Normals alone;
          alone.H.setZero(size(), size()), alone.g.setZero(size());
          Track trial = track;
          known = add_track(camera, trial, alone) && alone.squares < most_squares(alone.freedom);
        }
      }
      if (known) add_track(camera, track, n);
      // What it said is said; what is seen of it from now on is another point.
      track.seen.clear();
      track.active = false;
      it = track.ended ? tracks_[camera].erase(it) : std::next(it);
    }
  const int at = at_state(gone), width = state_size(), rest = size() - width;
  std::vector<int> keep;
  for (int i = 0; i < size(); ++i)
    if (i < at || i >= at + width) keep.push_back(i);
  const Eigen::MatrixXd H_gg = n.H.block(at, at, width, width);
  const Eigen::LLT<Eigen::MatrixXd> llt(H_gg);
  Eigen::MatrixXd H_gk(width, rest);
  for (int q = 0; q < rest; ++q) H_gk.col(q) = n.H.block(at, keep[static_cast<std::size_t>(q)], width, 1);
  const Eigen::MatrixXd half = llt.matrixL().solve(H_gk);
  const Eigen::VectorXd half_g = llt.matrixL().solve(n.g.segment(at, width));
  Eigen::MatrixXd H(rest, rest);
  Eigen::VectorXd g(rest);
  for (int q = 0; q < rest; ++q) {
    g[q] = n.g[keep[static_cast<std::size_t>(q)]];
    for (int p = 0; p < rest; ++p) H(p, q) = n.H(keep[static_cast<std::size_t>(p)], keep[static_cast<std::size_t>(q)]);
  }
  H.noalias() -= half.transpose() * half;
  g.noalias() -= half.transpose() * half_g;
  prior_.H = 0.5 * (H + H.transpose());
  states_.erase(states_.begin() + static_cast<std::ptrdiff_t>(gone));
  if (gone > 0) states_[gone - 1].to_next.reset();
  prior_.g = std::move(g);
  for (State& s : states_) s.at_prior = s.motion, s.clocks_at_prior = s.clocks;
  cameras_at_prior_ = cameras_;
  marginalised_ = true;
}

OffsetBelief SlidingWindow::belief(std::size_t camera) const {
  OffsetBelief b = beliefs_[camera];
  b.line_delay_s = cameras_[camera].line_delay_s;
  b.extrinsics = cameras_[camera].extrinsics;
  b.intrinsics = cameras_[camera].intrinsics;
  OffsetAndDrift now = covariances_[camera];
  now.offset_s = states_.back().clocks[camera].offset_s, now.drift = states_.back().clocks[camera].drift;
  believe(now, ppm * options_.drift_sigma_ppm, b);
  return b;
}

}  // namespace takt::online
