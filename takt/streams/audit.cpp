// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/audit.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace takt {

namespace {

constexpr double fastest_gyro_rad_s = 35;   // 2000 deg/s, the full scale of common gyros
constexpr double least_gyro_range = 4.3;    // rad/s: 250 deg/s, their smallest
constexpr double least_accel_range = 19.5;  // m/s²: 2 g, likewise
constexpr std::size_t clipped_run = 3;      // samples in a row at the extreme value: noise does not do that

template <class Stream>
StreamAudit about(const Stream& stream, const char* kind) {
  return {stream.name, kind, stream.clock, audit(stream.stamps), {}};
}

std::vector<double> norms(const std::vector<Vec3>& values) {
  std::vector<double> out;
  for (const Vec3& v : values)
    if (v.allFinite()) out.push_back(v.norm());
  return out;
}

/// Of sorted values; `at` from 0 to 1.
double percentile(std::vector<double>& values, double at) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(at * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// The longest run of rows that are all alike.
std::size_t longest_repeat(const std::vector<Vec3>& values) {
  std::size_t longest = 0, run = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    run = values[i] == values[i - 1] ? run + 1 : 0;
    longest = std::max(longest, run);
  }
  return longest > 0 ? longest + 1 : 0;
}

/// Says where an axis stays at its largest magnitude for some samples, beyond the smallest range of such a sensor.
void say_clipped(const std::vector<Vec3>& values, double least_range, const char* what, const char* unit,
                 std::vector<std::string>& words) {
  for (int axis = 0; axis < 3; ++axis) {
    double extreme = 0;
    for (const Vec3& v : values)
      if (std::isfinite(v[axis])) extreme = std::max(extreme, std::abs(v[axis]));
    if (extreme < least_range) continue;
    std::size_t clipped = 0, run = 0;
    for (const Vec3& v : values) {
      run = std::abs(v[axis]) == extreme ? run + 1 : 0;
      clipped += run == clipped_run ? clipped_run : run > clipped_run ? 1 : 0;
    }
    if (clipped > 0)
      words.push_back(
          fmt::format("{} {} is clipped at {:.4g} {} in {} samples", what, "xyz"[axis], extreme, unit, clipped));
  }
}

void say_stuck(const std::vector<Vec3>& values, const char* what, std::vector<std::string>& words) {
  constexpr std::size_t noticeable = 20;
  const std::size_t run = longest_repeat(values);
  if (run >= noticeable && run == values.size())
    words.push_back(fmt::format("{} never changes", what));
  else if (run >= noticeable)
    words.push_back(fmt::format("{} is stuck for {} samples in a row", what, run));
}

std::size_t count_non_finite(const ImuStream& imu) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const bool accel_good = imu.accel_m_s2.empty() || imu.accel_m_s2[i].allFinite();
    count += !(imu.gyro_rad_s[i].allFinite() && accel_good);
  }
  return count;
}

void say_gyro_unit(const ImuStream& imu, std::vector<std::string>& words) {
  std::vector<double> rates = norms(imu.gyro_rad_s);
  if (rates.empty()) return;
  const double typical = percentile(rates, 0.5), high = percentile(rates, 0.99);
  if (high > fastest_gyro_rad_s || typical > 5)
    words.push_back(fmt::format("rates look like deg/s: half are above {:.3g}, 1 % above {:.3g}", typical, high));
  else
    words.push_back(
        fmt::format("rates are plausible as rad/s: half are above {:.3g}, 1 % above {:.3g}", typical, high));
}

void say_accel_unit(const ImuStream& imu, std::vector<std::string>& words) {
  const std::vector<double> forces = norms(imu.accel_m_s2);
  if (forces.empty()) return;
  const double mean = std::accumulate(forces.begin(), forces.end(), 0.0) / static_cast<double>(forces.size());
  const auto near = [mean](double gravity) { return mean > 0.7 * gravity && mean < 1.5 * gravity; };
  const char* const verdict = near(9.81)   ? "m/s2, with gravity in it"
                              : near(1)    ? "g, not m/s2"
                              : near(1000) ? "mg, not m/s2"
                                           : "no known unit with gravity in it";
  words.push_back(fmt::format("accelerations of {:.3g} on average look like {}", mean, verdict));
}

}  // namespace

StreamAudit audit(const ImuStream& imu) {
  StreamAudit a = about(imu, "imu");
  if (const std::size_t broken = count_non_finite(imu); broken > 0)
    a.words.push_back(fmt::format("{} rows have values that are not finite", broken));
  say_gyro_unit(imu, a.words);
  say_accel_unit(imu, a.words);
  say_clipped(imu.gyro_rad_s, least_gyro_range, "gyro", "rad/s", a.words);
  say_clipped(imu.accel_m_s2, least_accel_range, "accelerometer", "m/s2", a.words);
  say_stuck(imu.gyro_rad_s, "gyro", a.words);
  say_stuck(imu.accel_m_s2, "accelerometer", a.words);
  return a;
}

StreamAudit audit(const CameraStream& camera) {
  StreamAudit a = about(camera, "camera");
  const auto [shortest, longest] = std::minmax_element(camera.exposures_s.begin(), camera.exposures_s.end());
  if (shortest != camera.exposures_s.end()) {
    const std::string from = fmt::format("{:.3g}", *shortest * 1e3), to = fmt::format("{:.3g}", *longest * 1e3);
    a.words.push_back(from == to ? "exposures of " + to + " ms" : "exposures from " + from + " to " + to + " ms");
  }
  if (a.stamps.rate_hz && longest != camera.exposures_s.end() && *longest * *a.stamps.rate_hz > 1)
    a.words.push_back("some exposures are longer than the time between frames");
  return a;
}

StreamAudit audit(const TrackStream& tracks) {
  StreamAudit a = about(tracks, "tracks");
  std::size_t least = std::numeric_limits<std::size_t>::max(), sum = 0;
  for (const auto& frame : tracks.features) {
    least = std::min(least, frame.size());
    sum += frame.size();
  }
  if (!tracks.features.empty())
    a.words.push_back(fmt::format("{:.0f} features a frame on average, at least {}",
                                  static_cast<double>(sum) / static_cast<double>(tracks.features.size()), least));
  return a;
}

StreamAudit audit(const AttitudeStream& attitude) {
  StreamAudit a = about(attitude, "attitude");
  const auto wrong = std::count_if(attitude.world_from_body.begin(), attitude.world_from_body.end(),
                                   [](const Quat& q) { return !(std::abs(q.norm() - 1) < 1e-3); });
  if (wrong > 0) a.words.push_back(fmt::format("{} orientations are no unit quaternions", wrong));
  return a;
}

StreamAudit audit(const AngleStream& angle) {
  StreamAudit a = about(angle, "angle");
  const auto broken =
      std::count_if(angle.angle_rad.begin(), angle.angle_rad.end(), [](double x) { return !std::isfinite(x); });
  if (broken > 0) a.words.push_back(fmt::format("{} angles are not finite", broken));
  double largest = 0;
  for (const double x : angle.angle_rad)
    if (std::isfinite(x)) largest = std::max(largest, std::abs(x));
  if (largest > 2 * std::numbers::pi) a.words.push_back(fmt::format("angles up to {:.3g} look like degrees", largest));
  return a;
}

std::vector<StreamAudit> audit(const Recording& recording) {
  std::vector<StreamAudit> all;
  for (const auto& s : recording.imus) all.push_back(audit(s));
  for (const auto& s : recording.cameras) all.push_back(audit(s));
  for (const auto& s : recording.tracks) all.push_back(audit(s));
  for (const auto& s : recording.attitudes) all.push_back(audit(s));
  for (const auto& s : recording.angles) all.push_back(audit(s));
  return all;
}

Tidied tidy(ImuStream imu) {
  Tidied out;
  const auto finite = [&imu](std::size_t i) {
    return imu.gyro_rad_s[i].allFinite() && (imu.accel_m_s2.empty() || imu.accel_m_s2[i].allFinite());
  };
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < imu.size(); ++i)
    if (finite(i)) order.push_back(i);
  const std::size_t non_finite = imu.size() - order.size();

  const auto earlier = [&imu](std::size_t a, std::size_t b) { return imu.stamps[a] < imu.stamps[b]; };
  const bool in_order = std::is_sorted(order.begin(), order.end(), earlier);
  if (!in_order) std::stable_sort(order.begin(), order.end(), earlier);
  const std::size_t all = order.size();
  const auto same = [&imu](std::size_t a, std::size_t b) { return imu.stamps[a] == imu.stamps[b]; };
  order.erase(std::unique(order.begin(), order.end(), same), order.end());

  if (non_finite > 0) out.words.push_back(fmt::format("{} rows with values that are not finite left out", non_finite));
  if (!in_order) out.words.push_back("rows put in order of time");
  if (order.size() < all)
    out.words.push_back(fmt::format("{} rows with a stamp that was there already left out", all - order.size()));
  if (out.words.empty()) {
    out.imu = std::move(imu);
    return out;
  }
  out.imu.name = imu.name;
  out.imu.clock = imu.clock;
  out.imu.noise = imu.noise;
  out.imu.T_body_imu = imu.T_body_imu;
  for (const std::size_t i : order) {
    out.imu.stamps.push_back(imu.stamps[i]);
    if (!imu.arrivals.empty()) out.imu.arrivals.push_back(imu.arrivals[i]);
    out.imu.gyro_rad_s.push_back(imu.gyro_rad_s[i]);
    if (!imu.accel_m_s2.empty()) out.imu.accel_m_s2.push_back(imu.accel_m_s2[i]);
  }
  return out;
}

}  // namespace takt
