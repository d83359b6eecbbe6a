// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/self_calibration.h"

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>
#include <tuple>

namespace takt::dial {
namespace {

constexpr std::size_t smoothing_slots = 60;

std::vector<std::size_t> by_place(const std::vector<Slot>& slots) {
  std::vector<std::size_t> order(slots.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(slots[a].strip, slots[a].angle_rad) < std::tie(slots[b].strip, slots[b].angle_rad);
  });
  return order;
}

/// Angles and greys by angle; those nearer to one another than `apart` become their mean.
std::vector<std::pair<double, double>> merged(std::vector<std::pair<double, double>> seen, double apart) {
  std::sort(seen.begin(), seen.end());
  std::vector<std::pair<double, double>> out;
  for (std::size_t i = 0, n = 0; i < seen.size(); i += n) {
    double angle = 0, grey = 0;
    for (n = 0; i + n < seen.size() && seen[i + n].first <= seen[i].first + apart; ++n)
      angle += seen[i + n].first, grey += seen[i + n].second;
    out.emplace_back(angle / static_cast<double>(n), grey / static_cast<double>(n));
  }
  return out;
}

}  // namespace

std::vector<float> smooth_light(const std::vector<const Profile*>& profiles, const std::vector<Slot>& slots) {
  std::vector<double> mean(slots.size(), 1e-3);
  for (const Profile* p : profiles)
    for (std::size_t i = 0; i < slots.size(); ++i) mean[i] += p->grey[i] / static_cast<double>(profiles.size());
  std::vector<float> light(slots.size(), 1);
  const std::vector<std::size_t> order = by_place(slots);
  for (std::size_t from = 0, to = 0; from < order.size(); from = to) {
    const auto same = [&](std::size_t i) { return slots[order[i]].strip == slots[order[from]].strip; };
    double all = 0;
    for (to = from; to < order.size() && same(to); ++to) all += mean[order[to]];
    all /= static_cast<double>(to - from);
    // A straight line through the neighbours, so that the ends are not pulled inwards.
    for (std::size_t i = from; i < to; ++i) {
      const std::size_t a = i > from + smoothing_slots ? i - smoothing_slots : from,
                        b = std::min(to, i + smoothing_slots);
      double n = 0, x = 0, y = 0, xx = 0, xy = 0;
      for (std::size_t j = a; j < b; ++j) {
        const double d = static_cast<double>(j) - static_cast<double>(i), v = mean[order[j]];
        ++n, x += d, y += v, xx += d * d, xy += d * v;
      }
      const double at = n > 2 ? (y * xx - x * xy) / (n * xx - x * x) : y / n;
      light[order[i]] = static_cast<float>(std::clamp(at / all, 0.1, 10.0));
    }
  }
  return light;
}

void refine_light(SlotMap& map, const std::vector<Placed>& frames, const Patterns& patterns) {
  std::vector<double> cross(map.slots.size(), 0), square(cross), low(map.slots.size(), 1e9),
      high(map.slots.size(), -1e9);
  for (const Placed& f : frames)
    for (std::size_t i = 0; i < map.slots.size(); ++i) {
      const Slot& slot = map.slots[i];
      const double angle = f.at.angle_of(slot, map.pivot_row);
      const double model = f.at.gain * patterns[static_cast<std::size_t>(slot.strip)].at(angle).grey + f.at.level;
      cross[i] += model * f.profile->grey[i];
      square[i] += model * model;
      low[i] = std::min(low[i], angle);
      high[i] = std::max(high[i], angle);
    }
  const double enough = 30 * patterns.front().step_rad;
  for (std::size_t i = 0; i < map.slots.size(); ++i)
    if (high[i] - low[i] > enough && square[i] > 0)
      map.light[i] = static_cast<float>(std::clamp(cross[i] / square[i], 0.05, 20.0));
}

Correction refine_angles(SlotMap& map, const std::vector<Placed>& frames, const Patterns& patterns,
                         const Freedom& freedom) {
  constexpr int shared = 6, own = 3;  // five of the angles and the line delay; reading, gain, level
  using Whole = Eigen::Matrix<double, shared + own, shared + own>;
  using Row = Eigen::Matrix<double, shared + own, 1>;
  Eigen::Matrix<double, shared, shared> normal = Eigen::Matrix<double, shared, shared>::Zero();
  Eigen::Matrix<double, shared, 1> right = Eigen::Matrix<double, shared, 1>::Zero();
  for (const Placed& f : frames) {
    Whole all = Whole::Zero();
    Row side = Row::Zero();
    for (std::size_t i = 0; i < map.slots.size(); ++i) {
      const Slot& slot = map.slots[i];
      if (std::abs(slot.angle_rad) > freedom.reach_rad) continue;
      const auto s = patterns[static_cast<std::size_t>(slot.strip)].at(f.at.angle_of(slot, map.pivot_row));
      const double light = map.light[i], a = slot.angle_rad, slope = light * f.at.gain * s.slope;
      Row g;
      g << slope * a, slope * a * a, slope * a * a * a, slope * slot.height_m, slope * slot.height_m * a,
          slope * f.speed_rad_s * (slot.row - map.pivot_row), slope, light * s.grey, light;
      const double residual = f.profile->grey[i] - light * (f.at.gain * s.grey + f.at.level);
      all.noalias() += slot.pixels * g * g.transpose();
      side.noalias() += slot.pixels * residual * g;
    }
    const Eigen::Matrix3d own_inverse =
        (all.bottomRightCorner<own, own>() + 1e-9 * Eigen::Matrix3d::Identity()).inverse();
    const Eigen::Matrix<double, shared, own> mixed = all.topRightCorner<shared, own>();
    normal += all.topLeftCorner<shared, shared>() - mixed * own_inverse * mixed.transpose();
    right += side.head<shared>() - mixed * own_inverse * side.tail<own>();
  }
  // What the frames do not tell stays as it is: a hundredth of the usual information holds it.
  for (int k = 0; k < shared; ++k) normal(k, k) *= 1 + 1e-4;
  normal.diagonal().array() += 1e-9;
  const auto hold = [&](int k) {
    normal.row(k).setZero();
    normal.col(k).setZero();
    normal(k, k) = 1;
    right[k] = 0;
  };
  if (freedom.scale_alone)
    for (int k = 1; k < 5; ++k) hold(k);
  if (!freedom.line_delay) hold(5);
  const Eigen::Matrix<double, shared, 1> k = normal.ldlt().solve(right);
  for (Slot& slot : map.slots) {
    const double a = slot.angle_rad;
    slot.angle_rad += k[0] * a + k[1] * a * a + k[2] * a * a * a + (k[3] + k[4] * a) * slot.height_m;
  }
  return {k[0], k[5]};
}

Patterns mosaic(const SlotMap& map, const std::vector<Placed>& frames, const Patterns& before) {
  constexpr double weight_of_before = 0.3;
  Patterns out = before;
  std::vector<std::vector<double>> sum(before.size()), tilt(before.size()), weight(before.size());
  for (std::size_t k = 0; k < before.size(); ++k) {
    weight[k].assign(before[k].grey.size(), weight_of_before);
    tilt[k].assign(before[k].grey.size(), 0);
    for (const float g : before[k].grey) sum[k].push_back(weight_of_before * static_cast<double>(g));
  }
  for (const Placed& f : frames) {
    if (!(f.at.gain > 0)) continue;
    for (std::size_t i = 0; i < map.slots.size(); ++i) {
      const Slot& slot = map.slots[i];
      const auto k = static_cast<std::size_t>(slot.strip);
      const double x = (f.at.angle_of(slot, map.pivot_row) - before[k].first_rad) / before[k].step_rad;
      if (!(x >= 0 && x < static_cast<double>(before[k].grey.size()) - 1)) continue;
      const auto j = static_cast<std::size_t>(x);
      const double part = x - static_cast<double>(j);
      const double grey = (f.profile->grey[i] / map.light[i] - f.at.level) / f.at.gain;
      sum[k][j] += (1 - part) * grey, weight[k][j] += 1 - part;
      sum[k][j + 1] += part * grey, weight[k][j + 1] += part;
      if (f.profile->tilt.empty()) continue;
      const double by_row = f.profile->tilt[i] / map.light[i] / f.at.gain;
      tilt[k][j] += (1 - part) * by_row, tilt[k][j + 1] += part * by_row;
    }
  }
  const bool rows = !frames.empty() && !frames.front().profile->tilt.empty();
  for (std::size_t k = 0; k < before.size(); ++k) {
    if (rows) out[k].tilt.resize(out[k].grey.size());
    for (std::size_t j = 0; j < out[k].grey.size(); ++j) {
      out[k].grey[j] = static_cast<float>(sum[k][j] / weight[k][j]);
      if (rows) out[k].tilt[j] = static_cast<float>(tilt[k][j] / weight[k][j]);
    }
  }
  return out;
}

Patterns single_view(const SlotMap& map, const Profile& profile, const Placement& at, double step_rad,
                     std::size_t strips) {
  Patterns out(strips);
  const std::vector<std::size_t> order = by_place(map.slots);
  for (std::size_t k = 0; k < strips; ++k) {
    std::vector<std::pair<double, double>> seen;
    for (const std::size_t i : order)
      if (map.slots[i].strip == static_cast<int>(k))
        seen.emplace_back(at.angle_of(map.slots[i], map.pivot_row), profile.grey[i] / map.light[i]);
    seen = merged(std::move(seen), 0.5 * step_rad);
    out[k].step_rad = step_rad;
    if (seen.size() < 2) {
      out[k].grey.assign(2, 0);
      out[k].first_rad = 1e9;  // covers nothing
      continue;
    }
    out[k].first_rad = seen.front().first;
    std::size_t j = 0;
    for (double a = seen.front().first; a < seen.back().first; a += step_rad) {
      while (j + 2 < seen.size() && seen[j + 1].first < a) ++j;
      const double width = seen[j + 1].first - seen[j].first;
      const double part = width > 0 ? std::clamp((a - seen[j].first) / width, 0.0, 1.0) : 0;
      out[k].grey.push_back(static_cast<float>(seen[j].second + part * (seen[j + 1].second - seen[j].second)));
    }
  }
  return out;
}

}  // namespace takt::dial
