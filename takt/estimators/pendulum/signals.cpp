// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/signals.h"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "takt/estimators/pendulum/repairs.h"
#include "takt/math/median.h"
#include "takt/streams/audit.h"

namespace takt::pendulum {
namespace {

/// The stamps' order, and how many of them stood in the wrong place.
template <class Less>
std::vector<std::size_t> sorted_order(std::size_t n, const Less& less, std::size_t& misplaced) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = 1; i < n; ++i) misplaced += less(i, i - 1);
  if (misplaced > 0) std::stable_sort(order.begin(), order.end(), less);
  return order;
}

void note_repairs(Signals& s, const std::string& stream, std::size_t misplaced, std::size_t duplicates,
                  std::size_t not_numbers) {
  if (misplaced > 0)
    s.notes.push_back(fmt::format("{}: {} stamps ran backwards and were put in order", stream, misplaced));
  if (duplicates > 0) s.notes.push_back(fmt::format("{}: {} repeated stamps were left out", stream, duplicates));
  if (not_numbers > 0) s.notes.push_back(fmt::format("{}: {} readings were not numbers", stream, not_numbers));
}

double median_interval(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (time[i] > time[i - 1]) steps.push_back(time[i] - time[i - 1]);
  return steps.empty() ? 0 : median(std::move(steps));
}

void note_gaps(Signals& s, const std::string& stream, const std::vector<double>& time, double interval) {
  int gaps = 0;
  double longest = 0;
  for (std::size_t i = 1; i < time.size(); ++i) {
    const double step = time[i] - time[i - 1];
    if (step < 1.8 * interval) continue;
    ++gaps;
    longest = std::max(longest, step);
  }
  if (gaps > 0) s.notes.push_back(fmt::format("{}: {} gaps, the longest {:.3f} s", stream, gaps, longest));
}

void leave_out_repeats(Signals& s, const std::string& stream, std::vector<double>& time, std::vector<Vec3>& rate) {
  const std::vector<bool> repeated = repeats(rate);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    if (repeated[i]) continue;
    time[kept] = time[i];
    rate[kept++] = rate[i];
  }
  if (kept < rate.size())
    s.notes.push_back(fmt::format("{}: {} readings repeat the one before under a new stamp and were left out", stream,
                                  rate.size() - kept));
  time.resize(kept);
  rate.resize(kept);
}

/// Angles of frames that came twice, and of frames in which something else was taken for the dial.
void leave_out_repeats_and_strays(Signals& s, const std::string& stream) {
  const auto leave_out = [&](const std::vector<bool>& which, const char* words) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < which.size(); ++i) {
      if (which[i]) continue;
      s.angle_time_s[kept] = s.angle_time_s[i];
      s.angle_rad[kept] = s.angle_rad[i];
      s.row[kept++] = s.row[i];
    }
    if (kept < which.size()) s.notes.push_back(fmt::format("{}: {} {}", stream, which.size() - kept, words));
    for (auto* column : {&s.angle_time_s, &s.angle_rad, &s.row}) column->resize(kept);
  };
  std::vector<Vec3> readings;
  for (const double a : s.angle_rad) readings.emplace_back(a, 0, 0);
  leave_out(repeats(readings), "readings repeat the one before under a new stamp and were left out");
  leave_out(strays(s.angle_time_s, s.angle_rad), "readings are far from their neighbours and were left out");
}

void take_angles(Signals& s, const AngleStream& dial, bool line_delay_unknown) {
  const double line_delay = line_delay_unknown ? 0 : dial.timing.line_delay_s();
  const auto row_of = [&](std::size_t i) { return dial.rows.empty() ? 0.0 : dial.rows[i]; };
  const auto less = [&](std::size_t a, std::size_t b) {
    return dial.stamps[a] != dial.stamps[b] ? dial.stamps[a] < dial.stamps[b] : row_of(a) < row_of(b);
  };
  std::size_t misplaced = 0, duplicates = 0, not_numbers = 0, unknown_exposures = 0;
  const auto order = sorted_order(dial.size(), less, misplaced);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    if (!std::isfinite(dial.angle_rad[i])) {
      ++not_numbers;
      continue;
    }
    if (k > 0 && dial.stamps[i] == dial.stamps[order[k - 1]] && row_of(i) == row_of(order[k - 1])) {
      ++duplicates;
      continue;
    }
    const bool own = !dial.exposures_s.empty() && dial.exposures_s[i] > 0;
    const double exposure = own ? dial.exposures_s[i] : dial.timing.exposure_s;
    unknown_exposures += dial.timing.instant != ExposureInstant::middle && !(exposure > 0);
    s.angle_time_s.push_back(seconds_since(s.epoch, dial.stamps[i]) + dial.timing.to_exposure_middle_s(exposure) +
                             row_of(i) * line_delay);
    s.angle_rad.push_back(dial.angle_rad[i]);
    s.row.push_back(line_delay_unknown ? row_of(i) : 0);
  }
  note_repairs(s, dial.name, misplaced, duplicates, not_numbers);
  if (dial.rows.empty()) leave_out_repeats_and_strays(s, dial.name);
  if (unknown_exposures > 0)
    s.doubts.push_back(fmt::format(
        "{}: the stamps are the exposure's {}, but the exposure of {} readings is not known: half of it is in the "
        "offset",
        dial.name, dial.timing.instant == ExposureInstant::start ? "start" : "end", unknown_exposures));
}

/// Rates at which the gyro stood at its limit: flat for at least 20 ms, twice or more, at the same extreme value on one
/// side. A swing's own top is flat to 1e-4 for 7 ms only, and noise makes it shorter.
std::vector<bool> stuck_at_limit(const std::vector<double>& time, const std::vector<double>& rate, double& limit) {
  std::vector<bool> stuck(rate.size(), false);
  limit = 0;
  for (const double side : {-1.0, 1.0}) {
    double extreme = 0;
    for (const double r : rate) extreme = std::max(extreme, side * r);
    std::vector<std::pair<std::size_t, std::size_t>> plateaus;
    for (std::size_t i = 0; i < rate.size();) {
      std::size_t j = i;
      while (j < rate.size() && side * rate[j] > extreme * (1 - 1e-4)) ++j;
      if (j > i && time[j - 1] - time[i] > 0.02) plateaus.emplace_back(i, j);
      i = std::max(j, i + 1);
    }
    if (plateaus.size() < 2) continue;
    limit = std::max(limit, extreme);
    for (const auto& [from, to] : plateaus)
      for (std::size_t k = from; k < to; ++k) stuck[k] = true;
  }
  return stuck;
}

void take_rates(Signals& s, const ImuStream& imu) {
  const auto less = [&](std::size_t a, std::size_t b) { return imu.stamps[a] < imu.stamps[b]; };
  std::size_t misplaced = 0, duplicates = 0, not_numbers = 0;
  std::vector<double> time;
  std::vector<Vec3> rate;
  const auto order = sorted_order(imu.size(), less, misplaced);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    if (!imu.gyro_rad_s[i].allFinite())
      ++not_numbers;
    else if (k > 0 && imu.stamps[i] == imu.stamps[order[k - 1]])
      ++duplicates;
    else {
      time.push_back(seconds_since(s.epoch, imu.stamps[i]));
      rate.push_back(imu.gyro_rad_s[i]);
    }
  }
  note_repairs(s, imu.name, misplaced, duplicates, not_numbers);
  if (rate.size() < 10) return;
  note_gaps(s, imu.name, time, median_interval(time));
  leave_out_repeats(s, imu.name, time, rate);

  Vec3 mean = Vec3::Zero();
  for (const Vec3& r : rate) mean += r / static_cast<double>(rate.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& r : rate) spread += (r - mean) * (r - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(spread);
  s.axis = eigen.eigenvectors().col(2);
  s.axis_share = spread.trace() > 0 ? eigen.eigenvalues()[2] / spread.trace() : 0;

  // What an axis shows that the bob does not turn about is bias and coarse counts, and flat without being a limit.
  const Vec3 share = s.axis.cwiseAbs();
  std::vector<bool> leave_out(rate.size(), false);
  const double margin_s = 0.02;  // the low-pass smears a clipped top over its neighbours
  for (int axis = 0; axis < 3; ++axis) {
    if (share[axis] < 0.1 * share.maxCoeff()) continue;
    std::vector<double> one;
    for (const Vec3& r : rate) one.push_back(r[axis]);
    double limit = 0;
    const auto stuck = stuck_at_limit(time, one, limit);
    double last = -1e9;
    for (std::size_t i = 0; i < stuck.size(); ++i) {
      if (stuck[i]) last = time[i], s.saturation_rad_s = limit;
      if (time[i] - last < margin_s) leave_out[i] = true;
    }
    double next = 1e300;
    for (std::size_t i = stuck.size(); i-- > 0;) {
      if (stuck[i]) next = time[i];
      if (next - time[i] < margin_s) leave_out[i] = true;
    }
  }
  for (std::size_t i = 0; i < rate.size(); ++i) {
    if (leave_out[i]) {
      ++s.saturated;
      continue;
    }
    s.rate_time_s.push_back(time[i]);
    s.rate_rad_s.push_back(s.axis.dot(rate[i]));
  }
}

/// Noise of one reading a frame.
double noise_of_angles(const Signals& s) {
  std::vector<double> time, angle;
  for (std::size_t i = 0; i < s.angle_rad.size(); ++i) {
    if (!time.empty() && s.angle_time_s[i] - time.back() < 0.5 * s.frame_interval_s) continue;
    time.push_back(s.angle_time_s[i]);
    angle.push_back(s.angle_rad[i]);
  }
  return noise_of(time, angle);
}

/// From means over a frame's interval, in which the gyro's low-pass leaves its neighbours alone.
double density_of_rates(const Signals& s) {
  const double cell_s = std::max(s.frame_interval_s, 4 * s.rate_interval_s);
  std::vector<double> time, rate;
  for (std::size_t i = 0; i < s.rate_time_s.size();) {
    double t = 0, r = 0, n = 0;
    for (const double until = s.rate_time_s[i] + cell_s; i < s.rate_time_s.size() && s.rate_time_s[i] < until; ++i)
      t += s.rate_time_s[i], r += s.rate_rad_s[i], ++n;
    time.push_back(t / n);
    rate.push_back(r / n);
  }
  return noise_of(time, rate) * std::sqrt(cell_s);
}

void check_lengths(const AngleStream& dial, const ImuStream& imu) {
  const std::size_t n = dial.stamps.size();
  if (dial.angle_rad.size() != n || (!dial.rows.empty() && dial.rows.size() != n) ||
      (!dial.exposures_s.empty() && dial.exposures_s.size() != n))
    throw std::invalid_argument(fmt::format("pendulum: {} stamps, {} angles, {} rows, {} exposures in {}", n,
                                            dial.angle_rad.size(), dial.rows.size(), dial.exposures_s.size(),
                                            dial.name));
  if (imu.gyro_rad_s.size() != imu.stamps.size())
    throw std::invalid_argument(
        fmt::format("pendulum: {} stamps but {} rates in {}", imu.stamps.size(), imu.gyro_rad_s.size(), imu.name));
}

/// As a double throughout: broken stamps may be further apart than an int64 can say.
double span_s(const std::vector<Stamp>& stamps) {
  const auto [first, last] = std::minmax_element(stamps.begin(), stamps.end());
  return (static_cast<double>(to_ns(*last)) - static_cast<double>(to_ns(*first))) * 1e-9;
}

/// Stamps of one stream in another unit than the other's, or empty: no recording has a gyro for a thousandth of it.
std::string refuse_spans(const AngleStream& dial, const ImuStream& imu) {
  const double angles = span_s(dial.stamps), rates = span_s(imu.stamps);
  constexpr double longest = 1e9;  // half of which the differences of stamps can hold with ease
  if (angles > longest || rates > longest)
    return fmt::format("{}'s stamps span {:.3g} s: some of them are broken", angles > rates ? dial.name : imu.name,
                       std::max(angles, rates));
  if (angles > 0 && rates > 0 && angles < 300 * rates && rates < 300 * angles) return "";
  return fmt::format("{}'s stamps span {:.3g} s and {}'s {:.3g} s: are those of one in another unit?", dial.name,
                     angles, imu.name, rates);
}

/// Standard deviation of stamps that are rounded to a grid; 0 where the grid may be the sensor's own clock: every step
/// alike, or some of them as short as the grid is wide (samples of an even clock of which some are missing).
double rounding_sigma_s(const std::vector<Stamp>& stamps) {
  const StampAudit a = audit(stamps);
  if (!a.resolution || (a.jitter_s && *a.jitter_s == 0)) return 0;
  std::vector<Stamp> sorted = stamps;
  std::sort(sorted.begin(), sorted.end());
  Duration shortest = Duration::max();
  for (std::size_t i = 1; i < sorted.size(); ++i)
    if (sorted[i] != sorted[i - 1]) shortest = std::min(shortest, sorted[i] - sorted[i - 1]);
  return shortest > 2 * *a.resolution ? to_seconds(*a.resolution) / std::sqrt(12.0) : 0;
}

/// A FIFO that is read out at once and stamped then: what the samples' own times were cannot be told.
void doubt_bursts(Signals& s, const std::string& stream, const std::vector<double>& time) {
  const double mean = (time.back() - time.front()) / static_cast<double>(time.size() - 1),
               usual = median_interval(time);
  if (usual > 0 && mean > 5 * usual)
    s.doubts.push_back(
        fmt::format("{}'s samples come in bursts: {:.3g} ms between stamps on the mean, {:.3g} ms as a "
                    "rule; the offset is that of the stamps, give the samples' own",
                    stream, mean * 1e3, usual * 1e3));
}

}  // namespace

Signals prepare(const AngleStream& dial, const ImuStream& imu, bool line_delay_unknown) {
  check_lengths(dial, imu);
  Signals s;
  if (dial.size() < 20 || imu.size() < 20) {
    s.refusal = fmt::format("too little data: {} angles and {} rates", dial.size(), imu.size());
    return s;
  }
  s.refusal = refuse_spans(dial, imu);
  if (!s.refusal.empty()) return s;
  s.epoch = *std::min_element(dial.stamps.begin(), dial.stamps.end());
  take_angles(s, dial, line_delay_unknown);
  take_rates(s, imu);
  if (s.angle_time_s.size() < 20 || s.rate_time_s.size() < 20) {
    s.refusal =
        fmt::format("too little data: {} angles and {} rates are usable", s.angle_time_s.size(), s.rate_time_s.size());
    return s;
  }
  std::vector<double> frames;
  for (const Stamp stamp : dial.stamps) frames.push_back(seconds_since(s.epoch, stamp));
  std::sort(frames.begin(), frames.end());
  s.frame_interval_s = median_interval(frames);
  s.rate_interval_s = median_interval(s.rate_time_s);
  s.angle_noise_rad = noise_of_angles(s);
  s.rate_density = density_of_rates(s);
  s.stamp_sigma_s = std::hypot(rounding_sigma_s(dial.stamps), rounding_sigma_s(imu.stamps));
  doubt_bursts(s, imu.name, s.rate_time_s);
  if (dial.timing.instant != ExposureInstant::middle && dial.timing.exposure_s > 1.1 * s.frame_interval_s) {
    s.refusal = fmt::format(
        "{}'s exposure of {:g} s is longer than the {:.3g} s from frame to frame: is it told in "
        "milliseconds?",
        dial.name, dial.timing.exposure_s, s.frame_interval_s);
    return s;
  }
  const double from = std::max(s.angle_time_s.front(), s.rate_time_s.front());
  const double to = std::min(s.angle_time_s.back(), s.rate_time_s.back());
  if (to - from < 50 * s.frame_interval_s) {
    s.refusal = fmt::format(
        "the streams do not overlap: angles cover {:.3f} to {:.3f} s, rates {:.3f} to {:.3f} s after the first frame; "
        "are both of one run, stamped by one clock?",
        s.angle_time_s.front(), s.angle_time_s.back(), s.rate_time_s.front(), s.rate_time_s.back());
    return s;
  }
  note_gaps(s, dial.name, frames, s.frame_interval_s);
  return s;
}

Signals with_line_delay(const Signals& signals, double line_delay_s) {
  Signals s = signals;
  const auto time = [&](std::size_t i) { return signals.angle_time_s[i] + signals.row[i] * line_delay_s; };
  std::vector<std::size_t> order(signals.angle_time_s.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return time(a) < time(b); });
  for (std::size_t k = 0; k < order.size(); ++k) {
    s.angle_time_s[k] = time(order[k]);
    s.angle_rad[k] = signals.angle_rad[order[k]];
  }
  s.row.assign(order.size(), 0);
  return s;
}

}  // namespace takt::pendulum
