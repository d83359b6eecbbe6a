// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/attitude_rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "takt/math/median.h"
#include "takt/signals/rotation_chain.h"

namespace takt {

namespace {

struct Sample {
  Stamp stamp;
  Quat q;
};

/// The step in which the quaternions' components are written: the smallest distance of two different values.
double component_step(const std::vector<Sample>& samples) {
  std::vector<double> values;
  const std::size_t stride = std::max<std::size_t>(1, samples.size() / 5000);
  for (std::size_t i = 0; i < samples.size(); i += stride)
    for (int k = 0; k < 4; ++k) values.push_back(samples[i].q.coeffs()[k]);
  std::sort(values.begin(), values.end());
  double step = 1;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (const double d = values[i] - values[i - 1]; d > 1e-12) step = std::min(step, d);
  return step < 1 ? step : 1e-12;
}

/// Standard deviation of one orientation about one axis (rad), from fifth differences of the increments, which are
/// sixth differences of the orientation: Σ binomial(6,k)² = 924.
double orientation_sigma(const std::vector<RotationIncrement>& increments) {
  static constexpr std::array<double, 6> weights{1, -5, 10, -10, 5, -1};
  std::vector<double> magnitudes;
  for (std::size_t i = 0; i + weights.size() <= increments.size(); ++i) {
    Vec3 d = Vec3::Zero();
    bool unbroken = true;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      d += weights[k] * increments[i + k].rotation;
      unbroken = unbroken && (k == 0 || increments[i + k].from == increments[i + k - 1].to);
    }
    if (!unbroken) continue;
    for (int axis = 0; axis < 3; ++axis) magnitudes.push_back(std::abs(d[axis]));
  }
  return magnitudes.empty() ? 0 : 1.4826 * median(std::move(magnitudes)) / std::sqrt(924.0);
}

/// Whether sample i repeats an old value: followed by a jump (or, at the end, preceded by one) it does; followed by no
/// more than steps of the last digit it is stillness.
bool is_stale(const std::vector<Sample>& samples, std::size_t i, double jump_rad) {
  const auto value = [&](std::size_t k) { return samples[k].q.coeffs(); };
  const auto jumps = [&](std::size_t a, std::size_t b) {
    return log_so3(samples[a].q.conjugate() * samples[b].q).norm() > jump_rad;
  };
  if (value(i) != value(i - 1)) return false;
  std::size_t next = i;
  while (next < samples.size() && value(next) == value(i)) ++next;
  if (next < samples.size()) return jumps(i, next);
  std::size_t first = i;
  while (first > 0 && value(first - 1) == value(i)) --first;
  return first > 0 && i == first + 1 && jumps(first - 1, i);
}

}  // namespace

RotationSignal attitude_rotation(const AttitudeStream& attitude) {
  RotationSignal signal;
  signal.name = attitude.name;
  signal.clock = attitude.clock;
  signal.source = "attitude";
  const auto note = [&](std::size_t count, const char* what) {
    if (count > 0) signal.notes.push_back(fmt::format("{} of {} orientations {}", count, attitude.size(), what));
  };

  std::size_t broken = 0, backward = 0, repeated = 0;
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < attitude.size(); ++i) {
    const Quat& q = attitude.world_from_body[i];
    if (!q.coeffs().allFinite() || std::abs(q.norm() - 1) > 0.01) {
      ++broken;
    } else if (!samples.empty() && attitude.stamps[i] <= samples.back().stamp) {
      ++backward;
    } else {
      samples.push_back({attitude.stamps[i], q});
    }
  }

  const double step_rad = 2 * component_step(samples);
  std::vector<Sample> fresh;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!fresh.empty() && is_stale(samples, i, 4 * step_rad)) {
      ++repeated;
      continue;
    }
    fresh.push_back(samples[i]);
  }

  std::vector<Stamp> stamps;
  for (const Sample& s : fresh) stamps.push_back(s.stamp);
  const double gap_s = 3.5 * median_step_s(stamps);
  for (std::size_t i = 1; i < fresh.size(); ++i) {
    if (to_seconds(fresh[i].stamp - fresh[i - 1].stamp) > gap_s) continue;
    signal.increments.push_back({fresh[i - 1].stamp, fresh[i].stamp,
                                 log_so3(fresh[i - 1].q.normalized().conjugate() * fresh[i].q.normalized())});
  }

  const double rounding = step_rad / std::sqrt(12.0);
  const double sigma = std::max(orientation_sigma(signal.increments), rounding);
  for (RotationIncrement& r : signal.increments) r.information = Mat3::Identity() / (2 * sigma * sigma);
  note(broken, "are no rotation and were left out");
  note(backward, "are not later than the one before them and were left out");
  note(repeated, "repeat the one before them while it was turning and were left out");
  return signal;
}

}  // namespace takt
