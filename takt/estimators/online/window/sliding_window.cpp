// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/window/sliding_window.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "takt/estimators/online/window/window_system.h"

namespace takt::online {

namespace {

constexpr std::size_t window_states = 12;
/// A camera's frames closer than this to its one before are passed over: the window shall span a second. Unless the rig
/// turns so fast that points would be lost before they have been seen often enough.
constexpr double least_spacing_s = 0.07, most_turn_rad = 0.12;
/// Another camera's frame so near to a state is its; else it gets a state of its own.
constexpr double same_instant_s = 0.005;
constexpr std::size_t fewest_sightings = 3, most_active = 70;
constexpr double extrinsic_turn_sigma = 5e-3, extrinsic_shift_sigma = 5e-3;
/// A frame of a motion that does not tell the offset is fitted as if its stamp might be off by this.
constexpr double unheeded_stamp_s = 0.05;

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
