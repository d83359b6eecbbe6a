// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/coarse.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt::pendulum {
namespace {

struct Slope {
  double time_s, rate;
};

/// Differences of the angle over about one frame interval; none across gaps.
std::vector<Slope> slopes(const Signals& s) {
  std::vector<Slope> out;
  std::size_t before = 0;
  for (std::size_t i = 1; i < s.angle_time_s.size(); ++i) {
    const double step = s.angle_time_s[i] - s.angle_time_s[before];
    if (step < 0.5 * s.frame_interval_s) continue;
    if (step < 2.5 * s.frame_interval_s)
      out.push_back({s.angle_time_s[before] + 0.5 * step, (s.angle_rad[i] - s.angle_rad[before]) / step});
    before = i;
  }
  return out;
}

/// Means of the rate over cells of equal length; not-a-number where a cell is empty.
struct Grid {
  double start, step;
  std::vector<double> cell;

  [[nodiscard]] double at(double t) const {
    const double x = (t - start) / step;
    return x >= 0 && x < static_cast<double>(cell.size()) ? cell[static_cast<std::size_t>(x)]
                                                          : std::numeric_limits<double>::quiet_NaN();
  }
};

Grid gridded(const Signals& s, double step) {
  const double start = s.rate_time_s.front() - 0.5 * step;
  Grid g{start, step, {}};
  const auto n = static_cast<std::size_t>((s.rate_time_s.back() - start) / step) + 1;
  g.cell.assign(n, 0);
  std::vector<int> count(n, 0);
  for (std::size_t i = 0; i < s.rate_time_s.size(); ++i) {
    const auto k = static_cast<std::size_t>((s.rate_time_s[i] - start) / step);
    g.cell[k] += s.rate_rad_s[i];
    ++count[k];
  }
  for (std::size_t k = 0; k < n; ++k)
    g.cell[k] = count[k] > 0 ? g.cell[k] / count[k] : std::numeric_limits<double>::quiet_NaN();
  return g;
}

struct Match {
  double correlation = 0, scale = 0;
};

Match match_at(const std::vector<Slope>& angle, const Grid& gyro, double delay) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (const Slope& a : angle) {
    const double g = gyro.at(a.time_s + delay);
    if (std::isnan(g)) continue;
    n += 1;
    x += a.rate;
    y += g;
    xx += a.rate * a.rate;
    xy += a.rate * g;
    yy += g * g;
  }
  if (n < 10) return {};
  const double var_x = xx - x * x / n, var_y = yy - y * y / n, cov = xy - x * y / n;
  if (!(var_x > 0 && var_y > 0)) return {};
  return {cov / std::sqrt(var_x * var_y), cov / var_x};
}

}  // namespace

Coarse coarse_match(const Signals& signals, double search_s) {
  const auto angle = slopes(signals);
  const double step = std::max(0.25 * signals.frame_interval_s, 1.01 * signals.rate_interval_s);
  const Grid gyro = gridded(signals, step);
  const int reach = static_cast<int>(search_s / step);
  std::vector<Match> matches;
  for (int k = -reach - 1; k <= reach + 1; ++k) matches.push_back(match_at(angle, gyro, k * step));
  int best = 0;
  for (int k = -reach; k <= reach; ++k) {
    const auto i = static_cast<std::size_t>(k + reach + 1);
    if (std::abs(matches[i].correlation) > std::abs(matches[static_cast<std::size_t>(best + reach + 1)].correlation))
      best = k;
  }
  const auto i = static_cast<std::size_t>(best + reach + 1);
  const double left = std::abs(matches[i - 1].correlation), top = std::abs(matches[i].correlation),
               right = std::abs(matches[i + 1].correlation);
  const double bend = left - 2 * top + right;
  const double shift = bend < 0 ? std::clamp(0.5 * (left - right) / bend, -1.0, 1.0) : 0;
  return {(best + shift) * step, matches[i].scale, top};
}

}  // namespace takt::pendulum
