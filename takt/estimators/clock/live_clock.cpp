// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/live_clock.h"

#include <algorithm>
#include <cmath>

#include "takt/estimators/clock/bound_hull.h"
#include "takt/time/time_scales.h"

namespace takt {

namespace {

constexpr std::size_t kept_samples = 4096;
constexpr std::size_t kept_seconds = 128;  // over which labels must agree
constexpr std::size_t enough_to_start = 8;
constexpr std::size_t longest_distrust = 3600;  // pulses
constexpr double silent_s = 2.5;                // without a pulse the clock is in holdover
constexpr double least_gate_s = 5e-6;
constexpr std::size_t bounding_pulses = 8;
constexpr double most_drift_per_s = 2e-8;  // of a bare crystal's rate

}  // namespace

LiveClock::LiveClock(const DeviceCounter& counter, const LabelOptions& labels, std::optional<double> pulse_error_s)
    : counter_(counter), options_(labels), pulse_error_s_(pulse_error_s), extender_(counter.bits, counter.tick_hz) {}

void LiveClock::start_over() {
  waiting_.clear();
  recent_.clear();
  samples_.clear();
  labels_.clear();
  filter_ = ClockFilter{};
  running_ = false;
  train_pulses_ = 0;
  gps_minus_count_.reset();
  state_ = ClockState::ambiguous;
}

double LiveClock::elapsed_s(std::int64_t ticks) const {
  return static_cast<double>(static_cast<long double>(ticks - first_ticks_) /
                             static_cast<long double>(counter_.tick_hz));
}

bool LiveClock::observe_pulse(std::int64_t raw) {
  const ExtendedCount at = extender_.extend(raw);
  if (at.restarts > restarts_) {
    restarts_ = at.restarts;
    distrusted_ = 0;
    start_over();
    why_ = "the counter started again";
  }
  if (running_) {
    const double rate = filter_.at(filter_.time_s()).frequency;
    const double since = static_cast<double>(at.ticks - last_ticks_) / counter_.tick_hz / (1 + rate);
    const auto seconds = static_cast<std::int64_t>(std::llround(since));
    const auto t = static_cast<double>(last_second_ + seconds);
    const double phase = elapsed_s(at.ticks) - t + 0.5 / counter_.tick_hz;
    const ClockPrediction p = filter_.at(t);
    const double gate =
        std::max(least_gate_s, 6 * std::sqrt(p.phase_sigma_s * p.phase_sigma_s + filter_.noise().white_phase_s2 +
                                             filter_.noise().wander_s2)) +
        2 / counter_.tick_hz;
    if (seconds >= 1 && std::abs(phase - p.phase_s) < gate) {
      accept(last_second_ + seconds, at.ticks);
      waiting_.clear();
      return true;
    }
    ++rejected_;
  }
  waiting_.push_back(at.ticks);
  if (waiting_.size() > 64) waiting_.erase(waiting_.begin());
  return try_to_start();
}

/// Enough edges a second apart make a train; where another one runs it must have been silent meanwhile.
bool LiveClock::try_to_start() {
  if (waiting_.size() < enough_to_start) return false;
  PulseStream stream;
  stream.counter = counter_;
  stream.counter.bits = 64;
  for (const std::int64_t t : waiting_) stream.pulses.push_back({.ticks = t});
  const PulseTrain train = find_pulse_train(stream);
  if (train.segments.empty() || train.segments.back().pulses.size() < enough_to_start) return false;
  const TrainSegment segment = train.segments.back();
  if (segment.pulses.back().ticks != waiting_.back()) return false;
  // The new train may be the pulse's other edge: as offline, nine in ten must agree before either is believed.
  if (running_ && gps_minus_count_) distrusted_ = std::min(9 * train_pulses_, longest_distrust);
  const std::deque<TimeLabel> labels = running_ ? std::deque<TimeLabel>{} : labels_;
  start_over();
  labels_ = labels;
  running_ = true;
  first_ticks_ = segment.pulses.front().ticks;
  for (const TrainPulse& p : segment.pulses) accept(p.second, p.ticks);
  return true;
}

void LiveClock::accept(std::int64_t second, std::int64_t ticks) {
  ++accepted_;
  ++train_pulses_;
  if (distrusted_ > 0) --distrusted_;
  last_second_ = second;
  last_ticks_ = ticks;
  recent_.push_back({second, ticks, 0});
  while (recent_.size() > kept_seconds) recent_.pop_front();
  const PhaseSample s{static_cast<double>(second),
                      elapsed_s(ticks) - static_cast<double>(second) + 0.5 / counter_.tick_hz};
  samples_.push_back(s);
  while (samples_.size() > kept_samples) samples_.pop_front();
  if (samples_.size() >= 4 && !filter_.started()) {
    // A first guess, loose enough for any crystal until the data have spoken.
    ClockNoise wide;
    wide.white_phase_s2 = std::max(1e-16, std::pow(1 / counter_.tick_hz, 2));
    wide.white_frequency = 1e-16;
    filter_ = ClockFilter(wide);
    const std::vector<PhaseSample> all(samples_.begin(), samples_.end());
    filter_.start(all.front(), rough_frequency(all), 1e-5);
    for (std::size_t i = 1; i < all.size(); ++i) filter_.observe(all[i]);
  } else if (filter_.started()) {
    filter_.observe(s);
  }
  if (time_to_tune(accepted_)) {
    const std::vector<PhaseSample> all(samples_.begin(), samples_.end());
    filter_.retune(fit_noise(all, 1 / counter_.tick_hz, kept_samples));
  }
  judge_labels();
}

void LiveClock::observe_label(const TimeLabel& label) {
  if (!label.arrival_ticks) return;
  TimeLabel l = label;
  l.arrival_ticks = extender_.nearest(*label.arrival_ticks);
  labels_.push_back(std::move(l));
  while (labels_.size() > 12 * kept_seconds) labels_.pop_front();
}

/// By the offline rules, over the last two minutes.
void LiveClock::judge_labels() {
  PulseTrain train;
  train.tick_hz = counter_.tick_hz;
  TrainSegment& segment = train.segments.emplace_back();
  segment.pulses.assign(recent_.begin(), recent_.end());
  segment.ticks_per_second = counter_.tick_hz * (1 + (filter_.started() ? filter_.at(filter_.time_s()).frequency : 0));
  PulseStream bare;
  bare.counter = counter_;
  bare.pulses.resize(1);
  std::vector<LabelStream> logs(1);
  for (const TimeLabel& l : labels_)
    if (*l.arrival_ticks >= segment.pulses.front().ticks) logs[0].labels.push_back(l);
  LabelledTrain now = label_train(train, bare, logs, options_);
  const SegmentLabels& found = now.segments.front();
  if (!found.known) {
    // What was known is not forgotten while nothing is said; it is when something else is said.
    if (found.votes + found.in_guard > 0 || !gps_minus_count_) {
      gps_minus_count_.reset();
      state_ = ClockState::ambiguous;
      why_ = found.why_not;
      return;
    }
  } else if (gps_minus_count_ && *gps_minus_count_ != found.gps_minus_count_s) {
    gps_minus_count_.reset();
    state_ = ClockState::ambiguous;
    why_ = "the labels have changed their mind by whole seconds";
    labels_.clear();
    return;
  } else {
    gps_minus_count_ = found.gps_minus_count_s;
    scale_ = std::move(now);
  }
  if (distrusted_ > 0) {
    gps_minus_count_.reset();
    state_ = ClockState::ambiguous;
    why_ = "the train of pulses has stepped: one of its edges is not the whole second";
    return;
  }
  state_ = ClockState::locked;
  why_.clear();
}

std::optional<DisciplinedStamp> LiveClock::stamp(std::int64_t raw) const {
  if (!running_ || !filter_.started()) return std::nullopt;
  CountExtender extender = extender_;
  const ExtendedCount at = extender.extend(raw);
  DisciplinedStamp out;
  if (at.restarts != restarts_) return out;
  const double elapsed = elapsed_s(at.ticks) + 0.5 / counter_.tick_hz;
  double t = elapsed;
  ClockPrediction p;
  for (int i = 0; i < 3; ++i) {
    p = filter_.at(t);
    t = elapsed - p.phase_s;
  }
  // The edge lies anywhere within its tick.
  out.sigma_s = std::hypot(p.phase_sigma_s, 1 / counter_.tick_hz / std::sqrt(12.0));
  if (!gps_minus_count_) return out;
  const double whole = std::floor(t);
  const std::int64_t gps_ns =
      (*gps_minus_count_ + static_cast<std::int64_t>(whole)) * 1'000'000'000 + std::llround((t - whole) * 1e9);
  out.reference_ns = scale_.utc_ns(gps_ns);
  out.state = t - static_cast<double>(last_second_) > silent_s ? ClockState::holdover : state_;
  if (pulse_error_s_) add_bounds(at.ticks, t, out);
  return out;
}

/// All lines through the last pulses' bounds, loosened by how far a clock whose rate moves can be from one.
void LiveClock::add_bounds(std::int64_t ticks, double t_s, DisciplinedStamp& out) const {
  if (recent_.size() < 2) return;
  const std::size_t first = recent_.size() - std::min(bounding_pulses, recent_.size());
  const auto ns_since = [&](std::int64_t at) {
    return static_cast<std::int64_t>(std::llroundl(static_cast<long double>(at - recent_[first].ticks) * 1e9L /
                                                   static_cast<long double>(counter_.tick_hz)));
  };
  const double half_tick_ns = 0.5e9 / counter_.tick_hz;
  const auto error_ns = static_cast<std::int64_t>(std::ceil(1e9 * *pulse_error_s_ + half_tick_ns)) + 1;
  BoundHull lower(BoundHull::Side::lower_bounds), upper(BoundHull::Side::upper_bounds);
  for (std::size_t i = first; i < recent_.size(); ++i) {
    const std::int64_t s = ns_since(recent_[i].ticks);
    const std::int64_t offset = (recent_[i].second - recent_[first].second) * 1'000'000'000 - s;
    upper.add({s, offset + error_ns});
    lower.add({s, offset - error_ns});
  }
  const double length = static_cast<double>(recent_.back().second - recent_[first].second);
  const double ahead = std::max(
      {t_s - static_cast<double>(recent_.back().second), static_cast<double>(recent_[first].second) - t_s, 0.0});
  const double straight = 1e9 * most_drift_per_s * length * length / 8;
  const double beyond = 1e9 * most_drift_per_s * ahead * 0.5 * (length + ahead);
  const std::int64_t s = ns_since(ticks);
  const auto b = bounds_at(lower, upper, s, straight);
  if (!b) return;
  // From seconds since the first bounding pulse to the answer's scale, by the answer itself.
  const auto here_ns = static_cast<long double>(t_s - static_cast<double>(recent_[first].second)) * 1e9L;
  const long double add = static_cast<long double>(s) - here_ns;
  out.lower_ns =
      out.reference_ns + static_cast<std::int64_t>(std::floor(b->lower_ns + add - beyond - half_tick_ns)) - 1;
  out.upper_ns = out.reference_ns + static_cast<std::int64_t>(std::ceil(b->upper_ns + add + beyond + half_tick_ns)) + 1;
}

double LiveClock::rate_ppm() const {
  return filter_.started() ? 1e6 * filter_.at(filter_.time_s()).frequency : 0;
}
double LiveClock::sigma_s() const {
  return filter_.started() ? filter_.at(filter_.time_s()).phase_sigma_s : 0;
}

}  // namespace takt
