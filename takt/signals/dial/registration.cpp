// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/registration.h"

#include <Eigen/Dense>

namespace takt::dial {
namespace {

constexpr int most_steps = 12;

bool takes_part(const Slot& slot, const Part& part) {
  return (part.band < 0 || slot.band == part.band) && std::abs(slot.angle_rad) <= part.reach_rad;
}

const Pattern& pattern_of(const Patterns& patterns, const Slot& slot) {
  return patterns[static_cast<std::size_t>(slot.level)];
}

/// Whether a pattern says anything at an angle.
bool covers(const Pattern& p, double angle) {
  return angle > p.first_rad + p.step_rad && angle < p.last_rad() - 2 * p.step_rad;
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

}  // namespace

Registration register_profile(const Profile& profile, const SlotMap& map, const Patterns& patterns, double guess_rad,
                              const Part& part) {
  Registration r;
  r.reading_rad = guess_rad;
  const double furthest = 12 * patterns.front().step_rad;  // a step of the search and a line's width
  bool settled = false;
  for (int round = 0; round <= most_steps; ++round) {
    Moments moments;
    for (std::size_t i = 0; i < map.slots.size(); ++i) {
      const Slot& slot = map.slots[i];
      if (!takes_part(slot, part)) continue;
      const Pattern& pattern = pattern_of(patterns, slot);
      const double angle = r.reading_rad + slot.angle_rad;
      if (!covers(pattern, angle)) continue;
      moments.add(slot.pixels, pattern.at(angle).grey, profile.grey[i] / map.light[i]);
    }
    r.correlation = moments.correlation();
    if (!(moments.w > 0)) return r;
    r.gain = moments.slope();
    r.level = (moments.y - r.gain * moments.x) / moments.w;

    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double squares = 0, rows = 0, slopes = 0;
    int used = 0;
    for (std::size_t i = 0; i < map.slots.size(); ++i) {
      const Slot& slot = map.slots[i];
      if (!takes_part(slot, part)) continue;
      const Pattern& pattern = pattern_of(patterns, slot);
      const double angle = r.reading_rad + slot.angle_rad;
      if (!covers(pattern, angle)) continue;
      const Pattern::Sample s = pattern.at(angle);
      const double light = map.light[i], slope = r.gain * s.slope;
      const Eigen::Vector3d gradient = light * Eigen::Vector3d(slope, s.grey, 1);
      const double residual = profile.grey[i] - light * (r.gain * s.grey + r.level), weight = slot.pixels;
      normal.noalias() += weight * gradient * gradient.transpose();
      right.noalias() += weight * residual * gradient;
      squares += weight * residual * residual;
      rows += weight * gradient[0] * gradient[0] * slot.row;
      slopes += weight * gradient[0] * gradient[0];
      ++used;
    }
    if (used < 8 || !(slopes > 0)) return r;
    const Eigen::Matrix3d inverse = normal.inverse();
    r.sigma_rad = std::sqrt(std::max(0.0, inverse(0, 0) * squares / (used - 3)));
    r.row = rows / slopes;
    if (settled || round == most_steps) break;
    const double step = std::clamp((inverse * right)[0], -patterns.front().step_rad, patterns.front().step_rad);
    if (!(std::abs(r.reading_rad + step - guess_rad) < furthest)) break;
    r.reading_rad += step;
    settled = std::abs(step) < 1e-4 * patterns.front().step_rad;
  }
  return r;
}

Candidate search_reading(const Profile& profile, const SlotMap& map, const Patterns& patterns, double from_rad,
                         double to_rad, double step_rad, const Part& part) {
  Candidate best{0.5 * (from_rad + to_rad), -1};
  struct Look {
    double angle;
    const Pattern* pattern;
    double weight, grey;
  };
  std::vector<Look> looks;
  double all = 0;
  for (std::size_t i = 0; i < map.slots.size(); ++i) {
    if (!takes_part(map.slots[i], part)) continue;
    looks.push_back({map.slots[i].angle_rad, &pattern_of(patterns, map.slots[i]),
                     static_cast<double>(map.slots[i].pixels), profile.grey[i] / map.light[i]});
    all += looks.back().weight;
  }
  const int steps = static_cast<int>(std::ceil((to_rad - from_rad) / step_rad));
  for (int k = 0; k <= steps; ++k) {
    const double reading = from_rad + k * step_rad;
    Moments m;
    for (const Look& look : looks) {
      const double angle = reading + look.angle;
      if (!covers(*look.pattern, angle)) continue;
      const auto i = static_cast<std::size_t>((angle - look.pattern->first_rad) / look.pattern->step_rad + 0.5);
      m.add(look.weight, look.pattern->grey[i], look.grey);
    }
    if (m.w < 0.3 * all) continue;
    if (const double c = m.correlation(); c > best.correlation) best = {reading, c};
  }
  return best;
}

}  // namespace takt::dial
