// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/registration.h"

#include <Eigen/Dense>
#include <algorithm>

namespace takt::dial {
namespace {

constexpr int most_steps = 12;

const Pattern& pattern_of(const Patterns& patterns, const Slot& slot) {
  return patterns[static_cast<std::size_t>(slot.strip)];
}

/// Whether a pattern says anything at an angle.
bool covers(const Pattern& p, double angle) {
  return angle > p.first_rad + p.step_rad && angle < p.last_rad() - 2 * p.step_rad;
}

float nearest(const Pattern& p, double angle) {
  return p.grey[static_cast<std::size_t>((angle - p.first_rad) / p.step_rad + 0.5)];
}

/// Weighted moments of two series.
struct Moments {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void add(double weight, double a, double b) {
    w += weight, x += weight * a, y += weight * b;
    xx += weight * a * a, xy += weight * a * b, yy += weight * b * b;
  }
  [[nodiscard]] double correlation() const {
    const double vx = xx - x * x / w, vy = yy - y * y / w;
    return w > 0 && vx > 0 && vy > 0 ? (xy - x * y / w) / std::sqrt(vx * vy) : 0;
  }
  [[nodiscard]] double slope() const { return (xy - x * y / w) / std::max(1e-12, xx - x * x / w); }
};

/// One slot as the registration sees it.
struct Look {
  const Pattern* pattern;
  double angle, row, light, pixels, grey;
};

std::vector<Look> looks_of(const Profile& profile, const SlotMap& map, const Patterns& patterns, const Part& part) {
  std::vector<Look> looks;
  looks.reserve(map.slots.size());
  for (std::size_t i = 0; i < map.slots.size(); ++i) {
    const Slot& slot = map.slots[i];
    if (std::abs(slot.angle_rad) > part.reach_rad) continue;
    looks.push_back({&pattern_of(patterns, slot), slot.angle_rad, slot.row - map.pivot_row, map.light[i],
                     static_cast<double>(slot.pixels), profile.grey[i]});
  }
  return looks;
}

/// First contrast and brightness.
bool start(Registration& r, const std::vector<Look>& looks) {
  Moments m;
  for (const Look& look : looks) {
    const double angle = r.reading_rad + look.angle + r.shift_rad(look.row);
    if (covers(*look.pattern, angle)) m.add(look.pixels, nearest(*look.pattern, angle), look.grey / look.light);
  }
  if (!(m.w > 0)) return false;
  r.gain = m.slope();
  r.level = (m.y - r.gain * m.x) / m.w;
  return true;
}

}  // namespace

Registration register_profile(const Profile& profile, const SlotMap& map, const Patterns& patterns,
                              const Placement& guess, const Part& part) {
  Registration r;
  static_cast<Placement&>(r) = guess;
  const std::vector<Look> looks = looks_of(profile, map, patterns, part);
  if (!start(r, looks)) return r;
  const double pattern_step = patterns.front().step_rad;
  const double furthest = 12 * pattern_step;  // a step of the search and a line's width
  double rows = 0;
  for (const Look& look : looks) rows = std::max(rows, std::abs(look.row));
  bool settled = false;
  for (int round = 0; round <= most_steps; ++round) {
    // Unknowns: reading, shear, gain, level.
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    Moments moments;
    double squares = 0;
    int used = 0;
    for (const Look& look : looks) {
      const double angle = r.reading_rad + look.angle + r.shift_rad(look.row);
      if (!covers(*look.pattern, angle)) continue;
      const Pattern::Sample s = look.pattern->at(angle);
      const double by_shear = look.pattern->grey_by_shear(angle);
      const double slope = look.light * r.gain * s.slope, grey = look.light * (s.grey + r.shear_rad * by_shear);
      const double sheared = slope * look.row + look.light * r.gain * by_shear;
      const Eigen::Vector4d gradient(slope, part.free_shear ? sheared : 0, grey, look.light);
      const double residual = look.grey - r.gain * grey - look.light * r.level;
      normal.noalias() += look.pixels * gradient * gradient.transpose();
      right.noalias() += look.pixels * residual * gradient;
      squares += look.pixels * residual * residual;
      moments.add(look.pixels, s.grey, look.grey / look.light);
      ++used;
    }
    if (used < 8 || !(normal(0, 0) > 0)) {
      r.correlation = 0;
      return r;
    }
    r.correlation = moments.correlation();
    if (!part.free_shear) normal(1, 1) = 1;
    const Eigen::Matrix4d inverse = normal.inverse();
    const double variance = squares / std::max(1, used - 4);
    r.sigma_rad = std::sqrt(std::max(0.0, inverse(0, 0) * variance));
    r.shear_sigma_rad = part.free_shear ? std::sqrt(std::max(0.0, inverse(1, 1) * variance)) : 0;
    if (settled || round == most_steps) break;
    const Eigen::Vector4d step = inverse * right;
    const double by = std::clamp(step[0], -pattern_step, pattern_step);
    if (!(std::abs(r.reading_rad + by - guess.reading_rad) < furthest)) break;
    r.reading_rad += by;
    const double part_taken = step[0] != 0 ? by / step[0] : 1;
    r.shear_rad += part_taken * step[1];
    r.gain += part_taken * step[2];
    r.level += part_taken * step[3];
    settled = std::abs(by) < 1e-3 * pattern_step && std::abs(step[1]) * rows < 1e-2 * pattern_step;
  }
  return r;
}

std::vector<Candidate> search_readings(const Profile& profile, const SlotMap& map, const Patterns& patterns,
                                       double from_rad, double to_rad, double step_rad, double shear_rad,
                                       const Part& part) {
  constexpr double nearly = 0.15;
  constexpr std::size_t most = 12;
  std::vector<Look> looks = looks_of(profile, map, patterns, part);
  double all = 0;
  for (Look& look : looks) {
    look.angle += shear_rad * look.row;
    look.grey /= look.light;
    all += look.pixels;
  }
  const int steps = static_cast<int>(std::ceil((to_rad - from_rad) / step_rad));
  std::vector<Candidate> seen{{0, -1}};  // with an end on both sides
  for (int k = 0; k <= steps; ++k) {
    const double reading = from_rad + k * step_rad;
    Moments m;
    for (const Look& look : looks) {
      const double angle = reading + look.angle;
      if (covers(*look.pattern, angle)) m.add(look.pixels, nearest(*look.pattern, angle), look.grey);
    }
    seen.push_back({reading, m.w < 0.3 * all ? -1 : m.correlation()});
  }
  seen.push_back({0, -1});
  std::vector<Candidate> peaks;
  for (std::size_t k = 1; k + 1 < seen.size(); ++k)
    if (seen[k].correlation > seen[k - 1].correlation && seen[k].correlation >= seen[k + 1].correlation)
      peaks.push_back(seen[k]);
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const Candidate& a, const Candidate& b) { return a.correlation > b.correlation; });
  while (!peaks.empty() && (peaks.size() > most || peaks.back().correlation < peaks.front().correlation - nearly))
    peaks.pop_back();
  return peaks;
}

}  // namespace takt::dial
