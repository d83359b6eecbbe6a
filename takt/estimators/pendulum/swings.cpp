// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/swings.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "takt/math/median.h"

namespace takt::pendulum {
namespace {

/// Instants of upward passage through rest. A passage counts once the angle has come from well below it.
std::vector<double> upward_passages(const Signals& s, double rest, double hysteresis) {
  std::vector<double> passages;
  bool armed = false;
  for (std::size_t i = 1; i < s.angle_rad.size(); ++i) {
    const double before = s.angle_rad[i - 1] - rest, now = s.angle_rad[i] - rest;
    armed = armed || before < -hysteresis;
    if (!armed || before >= 0 || now < 0) continue;
    armed = false;
    const double share = before / (before - now);
    passages.push_back(s.angle_time_s[i - 1] + share * (s.angle_time_s[i] - s.angle_time_s[i - 1]));
  }
  return passages;
}

/// Half of highest − lowest in [from, to], or 0 where a quarter of the swing is missing.
double amplitude_between(const Signals& s, double from, double to) {
  auto i = static_cast<std::size_t>(std::lower_bound(s.angle_time_s.begin(), s.angle_time_s.end(), from) -
                                    s.angle_time_s.begin());
  double low = 1e300, high = -1e300, last = from, gap = 0;
  for (; i < s.angle_time_s.size() && s.angle_time_s[i] <= to; ++i) {
    low = std::min(low, s.angle_rad[i]);
    high = std::max(high, s.angle_rad[i]);
    gap = std::max(gap, s.angle_time_s[i] - last);
    last = s.angle_time_s[i];
  }
  gap = std::max(gap, to - last);
  return gap > 0.25 * (to - from) || low > high ? 0 : 0.5 * (high - low);
}

void judge_freedom(Swings& s) {
  s.free = true;
  for (std::size_t i = 0; i < s.all.size() && s.free; ++i) {
    // A free swing from A to almost nothing changes its period by A²/16; 2 % leaves room for 30° and noise.
    const double period = s.all[i].period_s() / s.period_s - 1;
    if (std::abs(period) > 0.02) {
      s.free = false;
      s.not_free =
          fmt::format("the period at {:.1f} s differs by {:.1f} % from the others", s.all[i].from_s, 100 * period);
    } else if (i > 0 && s.all[i].amplitude_rad > 1.03 * s.all[i - 1].amplitude_rad + 1e-4) {
      s.free = false;
      s.not_free = fmt::format("the amplitude grows from {:.2f}° to {:.2f}° at {:.1f} s",
                               s.all[i - 1].amplitude_rad * 180 / std::numbers::pi,
                               s.all[i].amplitude_rad * 180 / std::numbers::pi, s.all[i].from_s);
    }
  }
}

}  // namespace

Swings find_swings(const Signals& signals) {
  Swings found;
  // Extremes without the outermost 0.2 %, which a lost dial may have spoilt.
  std::vector<double> sorted = signals.angle_rad;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t outer = sorted.size() / 500;
  const double low = sorted[outer], high = sorted[sorted.size() - 1 - outer];
  found.rest_rad = 0.5 * (low + high);
  const auto passages = upward_passages(signals, found.rest_rad, 0.02 * (high - low));
  for (std::size_t i = 1; i < passages.size(); ++i) {
    const double amplitude = amplitude_between(signals, passages[i - 1], passages[i]);
    if (amplitude > 0) found.all.push_back({passages[i - 1], passages[i], amplitude});
  }
  if (found.all.empty()) return found;
  std::vector<double> periods;
  for (const Swing& s : found.all) periods.push_back(s.period_s());
  found.period_s = median(std::move(periods));
  // Beside a gap the passages may be several periods apart: such a swing is none.
  std::erase_if(found.all, [&](const Swing& s) { return s.period_s() > 1.8 * found.period_s; });
  for (const Swing& s : found.all) found.amplitude_rad = std::max(found.amplitude_rad, s.amplitude_rad);
  judge_freedom(found);
  return found;
}

std::vector<Swing> within(const std::vector<Swing>& swings, double from_rad, double to_rad) {
  std::vector<Swing> chosen;
  for (const Swing& s : swings)
    if (s.amplitude_rad <= from_rad && s.amplitude_rad >= to_rad) chosen.push_back(s);
  return chosen;
}

}  // namespace takt::pendulum
