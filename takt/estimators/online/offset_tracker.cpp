// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/offset_tracker.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>

#include "takt/calibration/words.h"
#include "takt/estimators/alignment/alignment.h"
#include "takt/estimators/online/excitation.h"
#include "takt/estimators/online/filter/msckf.h"
#include "takt/estimators/online/first_motion.h"
#include "takt/estimators/online/stamp_watch.h"
#include "takt/estimators/online/window/sliding_window.h"

namespace takt {

using namespace online;

namespace {

/// One row a method.
const std::vector<MethodRow>& method_table() {
  static const std::vector<MethodRow> table{
      {"filter",
       [](const TrackingRig& rig, const TrackingOptions& options) -> std::unique_ptr<OffsetMethod> {
         return std::make_unique<Msckf>(rig, options);
       }},
      {"window", [](const TrackingRig& rig, const TrackingOptions& options) -> std::unique_ptr<OffsetMethod> {
         return std::make_unique<SlidingWindow>(rig, options);
       }}};
  return table;
}

const MethodRow& find_method(const std::string& name) {
  std::string names;
  for (const MethodRow& row : method_table()) {
    if (row.name == name) return row;
    names += (names.empty() ? "" : ", ") + std::string(row.name);
  }
  throw std::invalid_argument("OffsetTracker: no method is called '" + name + "'; there are " + names);
}

/// How much is kept while the first offset and motion are sought.
constexpr double longest_wait_s = 20;
constexpr std::size_t most_waiting = 2000;
/// A first motion is sought in this much of the latest frames.
constexpr double shortest_window_s = 1.2, longest_window_s = 3;
constexpr std::size_t most_window_frames = 40;
/// The filter starts from the first motion with its sigma times this, and sees the same frames again: their weight is
/// then counted 1/25 too often, which is nothing, and every Jacobian is taken near the truth.
constexpr double start_loosened = 5;
constexpr double longest_imu_hole_s = 0.15;
constexpr double held_too_long_s = 5, trusted_sigma_s = 1e-3, least_tracked_s = 1;
/// Of pictures, whose corners err alike from frame to frame: on EuRoC's 4.7 s the answer is 3.7 σ off.
constexpr double least_followed_s = 10;
/// A motion that is lost sooner was wrong from the start: nothing is learned from it.
constexpr double least_proven_s = 3;
/// An offset that may just have stepped is not trusted: from how many sigmas on, and for how long after them.
constexpr double doubtful = 4, doubted_for_s = 0.5;
/// What an offset that is not watched may do (1/√s·s): a drift of this size, one sigma.
constexpr double unwatched_drift = 5e-5;
/// A corner tracker's, until it is measured.
constexpr double usual_pixel_sigma = 0.5;
/// Without a first offset by rotation, the motion is sought from the given one; how far it may be wrong.
constexpr double guess_after_s = 4, guessed_offset_sigma_s = 0.04;
/// A wrong guess has shown by then: the features misfit, or the offset moves as if it stepped.
constexpr double guess_proven_s = 10;
constexpr double fastest_frames_hz = 25;

struct Waiting {
  TrackedFrame raw;
  BearingFrame frame;
};

struct CameraState {
  StampWatch watch;
  PictureRest rest;
  std::optional<Stamp> epoch;
  Stamp last_used{}, last_seen{};
  std::deque<Waiting> waiting;
  double half_readout_s = 0, to_middle_row_s = 0;
  double last_taken_s = -1e18;
  double pixel_sigma = 0.5;
  bool offset_found = false;
};

}  // namespace

const char* to_string(TrackingState s) {
  switch (s) {
    case TrackingState::searching:
      return "searching";
    case TrackingState::tracking:
      return "tracking";
    case TrackingState::holding:
      break;
  }
  return "holding";
}

std::vector<std::string> tracking_methods() {
  std::vector<std::string> names;
  for (const MethodRow& row : method_table()) names.emplace_back(row.name);
  return names;
}

struct OffsetTracker::State {
  State(TrackingRig r, TrackingOptions o, TurnMeasure t)
      : rig(std::move(r)),
        options(std::move(o)),
        turns(std::move(t)),
        method(find_method(options.method).make(rig, options)),
        excitation(imu_noise_of(rig)),
        cameras(rig.cameras.size()) {
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const TrackingCamera& from = rig.cameras[c];
      cameras[c].pixel_sigma = from.pixel_sigma.value_or(usual_pixel_sigma);
      cameras[c].half_readout_s = 0.5 * std::abs(from.timing.readout_s) + (from.timing.readout_s != 0 ? 1e-3 : 0);
      if (from.timing.row == RowReference::first)
        cameras[c].to_middle_row_s = from.timing.line_delay_s() * 0.5 * (from.model.height - 1);
      FirstMotion::Camera known_camera;
      known_camera.line_delay_s = from.timing.line_delay_s();
      known_camera.half_readout_s = from.timing.readout_s != 0 ? cameras[c].half_readout_s : 0;
      known_camera.line_delay_sigma_s = options.line_delay ? 2e-5 : 0;
      known_camera.intrinsics_sigma_px = options.refine_intrinsics ? intrinsics_sigma_px : 0;
      known_camera.extrinsics.R_imu_cam = from.T_imu_cam.topLeftCorner<3, 3>();
      known_camera.extrinsics.p_imu_cam = from.T_imu_cam.topRightCorner<3, 1>();
      known.cameras.push_back(known_camera);
    }
  }

  // --- what comes in ---
  void imu(const ImuSample& s) {
    if (!s.gyro_rad_s.allFinite() || !s.accel_m_s2.allFinite()) {
      ++broken;
      return;
    }
    if (imu_watch.observe(s.stamp) != StampWatch::Fate::good) return;
    if (!imu_epoch) imu_epoch = s.stamp;
    const double t = seconds_since(*imu_epoch, s.stamp);
    history.add(t, {s.gyro_rad_s, s.accel_m_s2});
    excitation.observe(t, {s.gyro_rad_s, s.accel_m_s2});
    work(false);
  }

  void frame(std::size_t c, const TrackedFrame& f) {
    CameraState& camera = cameras.at(c);
    const TrackingCamera& of = rig.cameras[c];
    if (camera.watch.observe(f.stamp) != StampWatch::Fate::good) return;
    camera.last_seen = f.stamp;
    if (!camera.epoch) camera.epoch = f.stamp;
    const double exposure_s = f.exposure_s > 0 ? f.exposure_s : of.timing.exposure_s;
    Waiting w{f, {}};
    w.frame.camera = c;
    w.frame.t_s =
        seconds_since(*camera.epoch, f.stamp) + of.timing.to_exposure_middle_s(exposure_s) + camera.to_middle_row_s;
    if (camera.watch.step_s() > 0 && w.frame.t_s - camera.last_taken_s < 0.6 / fastest_frames_hz) return;
    camera.last_taken_s = w.frame.t_s;
    for (const TrackedFeature& feature : f.features)
      if (const auto z = feature.pixel.allFinite() ? see(of.model, feature.pixel) : std::nullopt)
        w.frame.features.push_back({feature.id, *z});
    camera.rest.observe(w.frame.t_s, f.features, of.pixel_sigma);
    camera.waiting.push_back(std::move(w));
    work(false);
  }

  void work(bool last) {
    if (!running) search(last);
    if (running) advance(last);
    forget();
  }

  void forget() {
    double needed = history.empty() ? 0 : history.end_s() - longest_wait_s;
    if (running) needed = t_motion_s - longest_window_s;
    history.forget_before(needed);
    if (running) return;
    for (CameraState& camera : cameras)
      while (!camera.waiting.empty() &&
             (camera.waiting.size() > most_waiting ||
              camera.waiting.front().frame.t_s < camera.waiting.back().frame.t_s - longest_wait_s))
        camera.waiting.pop_front();
  }

  // --- the first offset and the first motion ---
  void search(bool last) {
    if (history.size() < 20 || cameras.front().waiting.size() < 5) return;
    const double now = history.end_s();
    if (!last && now < next_try_s) return;
    next_try_s = now + 0.3;
    if (excitation.resting() && cameras.front().rest.resting()) learn_from_rest();
    if (!excitation.observable()) {
      why = excitation.resting() ? "the offset is not observable: nothing moves yet"
                                 : "the offset is not observable: rate and velocity do not change";
      return;
    }
    guessed = !find_offsets();
    if (!guessed || guess_offsets()) find_motion();
  }

  void learn_from_rest() {
    const Reading mean = history.mean(history.end_s() - 0.2, 0.2);
    known.gyro_bias = mean.gyro, known.gyro_bias_sigma = 3e-3;
  }

  bool find_offsets() {
    bool all = true;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (cameras[c].offset_found) continue;
      if (!find_offset(c)) all = false;
    }
    return all;
  }

  /// Slow motion may not let rotation alone stand out; all that is seen together may.
  bool guess_offsets() {
    const auto& waiting = cameras.front().waiting;
    if (waiting.size() < 20 || waiting.back().frame.t_s - waiting.front().frame.t_s < guess_after_s) return false;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (cameras[c].offset_found) continue;
      known.cameras[c].offset_s = options.initial_offset_s - to_seconds(between(c));
      known.cameras[c].offset_sigma_s = guessed_offset_sigma_s;
    }
    return true;
  }

  /// By rotation, wherever it lies.
  bool find_offset(std::size_t c) {
    CameraState& camera = cameras[c];
    if (camera.waiting.size() < 20) return false;
    const double span = camera.waiting.back().frame.t_s - camera.waiting.front().frame.t_s;
    if (span < 1.5) return false;
    next_try_s = history.end_s() + std::max(0.4, 0.3 * span);
    TrackStream tracks;
    tracks.name = rig.cameras[c].name;
    tracks.timing = rig.cameras[c].timing;
    tracks.model = rig.cameras[c].model;
    tracks.pixel_sigma = rig.cameras[c].pixel_sigma;
    for (const Waiting& w : camera.waiting) {
      tracks.stamps.push_back(w.raw.stamp);
      tracks.features.push_back(w.raw.features);
      std::ranges::sort(tracks.features.back(), {}, &TrackedFeature::id);
    }
    ImuStream gyro;
    gyro.name = rig.imu_name;
    history.each([&](double t, const Reading& r) {
      gyro.stamps.push_back(*imu_epoch + from_seconds(t));
      gyro.gyro_rad_s.push_back(r.gyro);
    });
    // Around the offset that was given: the search is symmetrical about equal stamps, so the gyro is moved there.
    const Duration given = from_seconds(options.initial_offset_s);
    for (Stamp& t : gyro.stamps) t -= given;
    const Estimate found = align_somewhere(turns(tracks), gyro);
    if (!found.answered()) {
      why = "no first offset yet: " + (found.reasons.empty() ? std::string("no reason given") : found.reasons.front());
      return false;
    }
    known.cameras[c].offset_s = to_seconds(*found.offset + given - between(c));
    known.cameras[c].offset_sigma_s = std::clamp(3 * *found.sigma_s, 1e-3, 0.02);
    camera.offset_found = true;
    return true;
  }

  /// Wherever the data overlap; and where a motion that repeats itself leaves that open, near the given offset, where
  /// most are. A wrong one is found out by the first motion.
  [[nodiscard]] Estimate align_somewhere(const RotationSignal& turned, const ImuStream& gyro) const {
    Estimate first;
    for (const double within_s : {1e9, 0.7, 0.15}) {
      AlignmentOptions how;
      how.search_s = std::min(within_s, options.search_s.value_or(1e9));
      Estimate found;
      try {
        found = align_rotation(turned, gyro, how);
      } catch (const std::invalid_argument& e) {
        found = Estimate::refusal("ml", e.what());
      }
      if (found.answered()) return found;
      if (first.reasons.empty()) first = std::move(found);
    }
    return first;
  }

  void find_motion() {
    // The latest frames that the IMU covers.
    std::vector<std::pair<double, const BearingFrame*>> all;
    for (std::size_t c = 0; c < cameras.size(); ++c)
      for (const Waiting& w : cameras[c].waiting) {
        const double t = w.frame.t_s + known.cameras[c].offset_s;
        const double margin = 4 * known.cameras[c].offset_sigma_s + cameras[c].half_readout_s + 0.01;
        if (t - margin > history.begin_s() && t + margin < history.end_s()) all.emplace_back(t, &w.frame);
      }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    if (all.size() < 6 || all.back().first - all.front().first < shortest_window_s) {
      why = "too little has been seen yet";
      return;
    }
    const double from = all.back().first - longest_window_s;
    std::erase_if(all, [from](const auto& f) { return f.first < from; });
    if (history.longest_gap_s(all.front().first, all.back().first) > longest_imu_hole_s) {
      why = "the IMU has a hole";
      return;
    }
    std::vector<const BearingFrame*> frames;
    const std::size_t stride = (all.size() + most_window_frames - 1) / most_window_frames;
    for (std::size_t i = 0; i < all.size(); i += stride) frames.push_back(all[i].second);
    std::vector<double> sigmas;
    for (const CameraState& c : cameras) sigmas.push_back(c.pixel_sigma);
    FoundMotion found = find_first_motion(frames, history, known, sigmas);
    if (!found.motion) {
      if (std::ranges::all_of(cameras, [](const CameraState& c) { return c.offset_found; }))
        why = "no first motion yet: " + found.why_not;
      if (++failed_motions % 8 == 0)
        for (CameraState& c : cameras) c.offset_found = false;  // perhaps the offset was wrong
      return;
    }
    FirstMotion start = *found.motion;
    start.covariance *= start_loosened * start_loosened;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      // Stamps were taken as exact: what they share of their jitter the offset has.
      double& sigma_s = start.cameras[c].offset_sigma_s;
      const auto taken = std::ranges::count_if(frames, [c](const BearingFrame* f) { return f->camera == c; });
      sigma_s = start_loosened *
                std::hypot(sigma_s, cameras[c].watch.jitter_s() / std::sqrt(std::max(1.0, static_cast<double>(taken))));
      // Where the features' noise is not known, it is what they miss the first motion by.
      if (!rig.cameras[c].pixel_sigma) cameras[c].pixel_sigma *= std::clamp(found.misfit, 0.2, 3.0);
      start.cameras[c].pixel_sigma = cameras[c].pixel_sigma;
      cameras[c].offset_found = true;
    }
    method->start(start);
    running = true, failed_motions = 0, ++counted.starts;
    t_motion_s = t_started_s = start.t_s;
    held_since_s.reset();
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      auto& waiting = cameras[c].waiting;
      while (!waiting.empty() && waiting.front().frame.t_s + start.cameras[c].offset_s <= start.t_s)
        waiting.pop_front();
    }
  }

  // --- from frame to frame ---
  void advance(bool last) {
    while (running) {
      std::size_t next = cameras.size();
      double t_next = 0;
      bool complete = true;
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        if (cameras[c].waiting.empty()) {
          complete = false;
          continue;
        }
        const double t = cameras[c].waiting.front().frame.t_s + method->belief(c).offset_s;
        if (next == cameras.size() || t < t_next) next = c, t_next = t;
      }
      if (next == cameras.size()) return;
      CameraState& camera = cameras[next];
      const double covered = history.empty() ? -1e18 : history.end_s();
      const double margin = camera.half_readout_s + (last ? 0 : 0.004 + 2 * imu_watch.step_s());
      if (t_next + margin > covered) return;
      if (!complete && !last && t_next + 0.2 > covered) return;
      use(next);
    }
  }

  void use(std::size_t c) {
    CameraState& camera = cameras[c];
    Waiting w = std::move(camera.waiting.front());
    camera.waiting.pop_front();
    const double t_imu = w.frame.t_s + method->belief(c).offset_s;
    const double hole = history.longest_gap_s(t_motion_s, std::max(t_motion_s, t_imu));
    if (hole > longest_imu_hole_s) {
      lose(hole > 1e9 ? "the IMU does not cover the frames" : fmt::format("the IMU has a hole of {:.2f} s", hole));
      return;
    }
    if (camera.watch.jitter_s() > 2e-5) w.frame.stamp_sigma_s = camera.watch.jitter_s();
    w.frame.observable = excitation.observable();
    w.frame.still = excitation.resting() && camera.rest.resting();
    const FrameReport report = method->observe(w.frame, history);
    if (report.used) {
      t_motion_s = report.t_imu_s;
      camera.last_used = w.raw.stamp;
      ++counted.frames;
    }
    if (report.doubt > doubtful) t_doubted_s = t_motion_s;
    if (w.frame.observable && !w.frame.still)
      held_since_s.reset();
    else if (!held_since_s)
      held_since_s = t_motion_s;
    if (report.lost) {
      lose("the motion was lost");
    } else if (report.stepped) {
      if (t_motion_s - t_started_s < least_proven_s) {
        lose("the first motion was wrong", true);
        return;
      }
      ++counted.steps;
      for (auto& k : known.cameras) k.offset_sigma_s = 0.02;
      lose("the offset has stepped", true);
    }
  }

  /// Starts again with what was learned: biases, mounting, offsets.
  void lose(std::string reason, bool offsets_too = false) {
    const Motion m = method->motion();
    const bool proven = t_motion_s - t_started_s >= least_proven_s;
    if (proven && m.gyro_bias.allFinite() && m.gyro_bias.norm() < 0.5)
      known.gyro_bias = m.gyro_bias, known.gyro_bias_sigma = 5e-3;
    if (proven && m.accel_bias.allFinite() && m.accel_bias.norm() < 2) known.accel_bias = m.accel_bias;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      last_belief.resize(cameras.size());
      last_belief[c] = method->belief(c);
      if (!std::isfinite(last_belief[c].offset_s)) continue;
      known.cameras[c].offset_s = last_belief[c].offset_s;
      // The lens and the crystals stay the same.
      if (proven && last_belief[c].intrinsics.allFinite()) known.cameras[c].intrinsics = last_belief[c].intrinsics;
      if (proven)
        known.cameras[c].drift = last_belief[c].apart.drift,
        known.cameras[c].drift_sigma = std::sqrt(last_belief[c].apart.drift_variance);
      known.cameras[c].offset_sigma_s = offsets_too ? 0.02 : std::clamp(5 * last_belief[c].sigma_s, 1e-3, 0.02);
    }
    t_lost_s = t_motion_s;
    running = false;
    why = std::move(reason);
    next_try_s = t_motion_s + 0.5;
    for (CameraState& c : cameras) c.waiting.clear();
  }

  // --- what is known ---
  [[nodiscard]] Duration between(std::size_t c) const {
    if (!imu_epoch || !cameras[c].epoch) return Duration{0};
    return imu_epoch->time_since_epoch() - cameras[c].epoch->time_since_epoch();
  }

  [[nodiscard]] std::vector<std::string> audit(std::size_t c) const {
    std::vector<std::string> out;
    for (const std::string& w : imu_watch.words()) out.push_back(fmt::format("{}: {}", rig.imu_name, w));
    if (broken > 0)
      out.push_back(fmt::format("{}: {} samples were not finite and were left out", rig.imu_name, broken));
    for (const std::string& w : cameras[c].watch.words()) out.push_back(fmt::format("{}: {}", rig.cameras[c].name, w));
    return out;
  }

  [[nodiscard]] OffsetNow now(std::size_t c) const {
    OffsetNow out;
    const CameraState& camera = cameras.at(c);
    out.stamp = counted.frames > 0 && running ? camera.last_used : camera.last_seen;
    if (!running && last_belief.empty()) {
      out.reasons.push_back(why.empty() ? "nothing has been seen yet" : why);
      return out;
    }
    const OffsetBelief b = running ? method->belief(c) : last_belief[c];
    double sigma = b.sigma_s, offset = b.offset_s;
    out.verdict = Verdict::trusted;
    const auto weak = [&out](std::string reason) {
      out.verdict = Verdict::weak;
      out.reasons.push_back(std::move(reason));
    };
    if (running) {
      out.state = held_since_s ? TrackingState::holding : TrackingState::tracking;
      if (held_since_s) {
        const double held = t_motion_s - *held_since_s;
        const std::string words =
            fmt::format("for {:.1f} s the offset has not been observable ({}): it is held", held,
                        excitation.resting() ? "nothing moves" : "rate and velocity do not change");
        if (held > held_too_long_s)
          weak(words);
        else
          out.reasons.push_back(words);
      }
      if (guessed && t_motion_s - t_started_s < guess_proven_s)
        weak("no rotation stood out in the beginning, so the search began at the given offset: turn more");
      if (excitation.one_axis())
        weak("the rig turns about one axis only: the camera's mounting about it is not observable");
      if (t_motion_s - t_started_s < least_tracked_s) weak("the motion has only just begun");
      if (!rig.cameras[c].pixel_sigma && t_motion_s - t_started_s < least_followed_s)
        weak("seconds of followed corners only: their errors persist from picture to picture, which σ does not know");
      if (t_motion_s - t_doubted_s < doubted_for_s)
        weak("the latest frames do not fit the offset: it may have stepped");
      // Beyond 2 σ: what else the answer may be off by is to fit into the other two.
      if (b.hidden_drift_s > 2 * sigma)
        weak(fmt::format("whether the clocks run apart is not known yet: if they do, the offset may be off by {}",
                         rounded_time_words(b.hidden_drift_s)));
      if (method->misfit() > 2.5)
        weak(fmt::format("the features misfit {:.1f}-fold: the model misses something", std::sqrt(method->misfit())));
    } else {
      out.state = TrackingState::searching;
      const double since = history.empty() ? 0 : history.end_s() - t_lost_s;
      sigma = std::max(std::hypot(sigma, unwatched_drift * since), known.cameras[c].offset_sigma_s);
      weak(why + "; the offset is the last one known");
    }
    if (sigma > trusted_sigma_s) weak(fmt::format("little is known: σ is {}", rounded_time_words(sigma)));
    if (!std::isfinite(offset) || !std::isfinite(sigma)) {
      out.verdict = Verdict::refused;
      out.reasons.insert(out.reasons.begin(), "the filter broke down");
      return out;
    }
    out.offset = between(c) + from_seconds(offset);
    out.sigma_s = sigma;
    out.drift = b.drift, out.drift_sigma = b.drift_sigma;
    return out;
  }

  TrackingRig rig;
  TrackingOptions options;
  TurnMeasure turns;
  std::unique_ptr<OffsetMethod> method;
  Excitation excitation;
  std::vector<CameraState> cameras;
  StampWatch imu_watch;
  ImuHistory history;
  std::optional<Stamp> imu_epoch;
  BeforehandKnown known;
  std::vector<OffsetBelief> last_belief;  ///< before the last loss
  Counts counted;
  std::size_t broken = 0, failed_motions = 0;
  bool running = false;
  bool guessed = false;  ///< no rotation stood out: the first offset was the given one
  double next_try_s = 0, t_motion_s = 0, t_started_s = 0, t_lost_s = 0, t_doubted_s = -1e18;
  std::optional<double> held_since_s;
  std::string why;
};

OffsetTracker::OffsetTracker(TrackingRig rig, TrackingOptions options, TurnMeasure turns) {
  if (rig.cameras.empty()) throw std::invalid_argument("OffsetTracker: a rig without cameras");
  for (const TrackingCamera& c : rig.cameras)
    if (!(c.model.fx > 0) || c.model.height < 1)
      throw std::invalid_argument("OffsetTracker: " + c.name + " has no intrinsics");
  state_ = std::make_unique<State>(std::move(rig), std::move(options), std::move(turns));
}
OffsetTracker::~OffsetTracker() = default;
OffsetTracker::OffsetTracker(OffsetTracker&&) noexcept = default;
OffsetTracker& OffsetTracker::operator=(OffsetTracker&&) noexcept = default;

void OffsetTracker::observe_imu(const ImuSample& sample) {
  state_->imu(sample);
}
void OffsetTracker::observe_frame(std::size_t camera, const TrackedFrame& frame) {
  state_->frame(camera, frame);
}
void OffsetTracker::finish() {
  state_->work(true);
}
OffsetNow OffsetTracker::estimate(std::size_t camera) const {
  return state_->now(camera);
}
OffsetTracker::Counts OffsetTracker::counts() const {
  return state_->counted;
}

std::optional<PoseNow> OffsetTracker::pose() const {
  if (!state_->running || !state_->imu_epoch) return std::nullopt;
  const Motion m = state_->method->motion();
  return PoseNow{*state_->imu_epoch + from_seconds(state_->t_motion_s), m.R, m.p};
}

Estimate OffsetTracker::result(std::size_t camera) const {
  const OffsetNow now = estimate(camera);
  const TrackingCamera& of = state_->rig.cameras.at(camera);
  Estimate e;
  e.method = state_->options.method;
  e.sensor = of.name;
  e.reference = state_->rig.imu_name;
  e.verdict = now.verdict;
  e.reasons = now.reasons;
  e.notes = state_->audit(camera);
  e.epoch = now.stamp;
  if (!now.offset) return e;
  e.offset = now.offset;
  e.sigma_s = now.sigma_s;
  e.drift = now.drift;
  e.drift_sigma = now.drift_sigma;
  e.frame_instant = "middle";
  e.frame_row = of.timing.row == RowReference::first ? "first" : "middle";
  const OffsetBelief b = state_->running ? state_->method->belief(camera) : state_->last_belief[camera];
  e.line_delay_s = b.line_delay_s;
  if (b.line_delay_sigma_s > 0) e.line_delay_sigma_s = b.line_delay_sigma_s;
  Mat4 T = Mat4::Identity();
  T.topLeftCorner<3, 3>() = b.extrinsics.R_imu_cam;
  T.topRightCorner<3, 1>() = b.extrinsics.p_imu_cam;
  e.T_reference_sensor = T;
  if (b.turn_sigma.maxCoeff() > 0) {
    const Vec3 turn = log_so3(Quat(b.extrinsics.R_imu_cam).normalized());
    for (int i = 0; i < 3; ++i)
      e.extras.push_back({fmt::format("rotation_{}_rad", "xyz"[i]), turn[i], b.turn_sigma[i]});
    for (int i = 0; i < 3; ++i)
      e.extras.push_back({fmt::format("translation_{}_m", "xyz"[i]), b.extrinsics.p_imu_cam[i], b.shift_sigma[i]});
  }
  if (b.intrinsics_sigma.maxCoeff() > 0) {
    const double given[] = {of.model.fx, of.model.fy, of.model.cx, of.model.cy};
    const char* const names[] = {"fx_px", "fy_px", "cx_px", "cy_px"};
    for (int i = 0; i < 4; ++i) e.extras.push_back({names[i], given[i] + b.intrinsics[i], b.intrinsics_sigma[i]});
  }
  const auto counted = state_->counted;
  e.extras.push_back({"frames", static_cast<double>(counted.frames), std::nullopt});
  e.extras.push_back({"starts", static_cast<double>(counted.starts), std::nullopt});
  e.extras.push_back({"steps", static_cast<double>(counted.steps), std::nullopt});
  return e;
}

}  // namespace takt
