// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/follow.h"

#include <algorithm>

#include "takt/signals/dial/self_calibration.h"

namespace takt::dial {
namespace {

/// Extrapolates the readings of the frames before, by their stamps.
class Prediction {
 public:
  explicit Prediction(double interval_s) : interval_s_(interval_s) {}

  void add(double time, const Registration& r) {
    if (!known_.empty() && !(time > known_.back().time)) return;
    if (known_.size() == 3) known_.erase(known_.begin());
    known_.push_back({time, r.reading_rad});
    shear_ = r.shear_rad;
  }
  [[nodiscard]] bool empty() const { return known_.empty(); }
  /// Lagrange through the last three, two, or one; the shear as it was.
  [[nodiscard]] Placement at(double time) const {
    double sum = 0;
    for (const auto& a : known_) {
      double term = a.reading;
      for (const auto& b : known_)
        if (a.time != b.time) term *= (time - b.time) / (a.time - b.time);
      sum += term;
    }
    return {sum, shear_};
  }
  /// How far the truth may be from it, in pixels.
  [[nodiscard]] double doubt_px(double time) const {
    const double gap = std::max(1.0, (time - known_.back().time) / interval_s_);
    return (known_.size() < 3 ? 40 : 4) * gap * gap;
  }

 private:
  struct Known {
    double time, reading;
  };
  double interval_s_;
  double shear_ = 0;
  std::vector<Known> known_;
};

/// Of the peaks between two readings the one that fits best between the pixels.
Registration seek(const Profile& p, const SlotMap& map, const Patterns& patterns, double from, double to, double step,
                  double shear, const Part& searched, const Part& registered) {
  Registration best;
  for (const Candidate& c : search_readings(p, map, patterns, from, to, step, shear, searched)) {
    const Registration r = register_profile(p, map, patterns, {c.reading_rad, shear}, registered);
    if (r.correlation > best.correlation) best = r;
  }
  return best;
}

Registration seek_near(const Profile& p, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                       const Placement& guess, double range, const Part& part) {
  return seek(p, map, patterns, guess.reading_rad - range, guess.reading_rad + range, 0.7 * pixel_rad, guess.shear_rad,
              part, part);
}

/// A shear that moves the outermost rows taking part by a cell's width.
double unit_of_shear(const SlotMap& map, const Part& part, double pixel_rad) {
  double furthest = 1;
  for (const Slot& s : map.slots)
    if (std::abs(s.angle_rad) <= part.reach_rad) furthest = std::max(furthest, std::abs(s.row - map.pivot_row));
  return 4 * pixel_rad / furthest;
}

}  // namespace

Registration search_anywhere(const Profile& p, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                             const Part& part) {
  Part middle = part;
  middle.reach_rad = std::min(part.reach_rad, 100 * pixel_rad);
  Registration best;
  const double unit = unit_of_shear(map, middle, pixel_rad);
  for (const double shear : {0, 1, -1, 2, -2, 3, -3}) {
    const Registration r = seek(p, map, patterns, patterns.front().first_rad, patterns.front().last_rad(),
                                0.8 * pixel_rad, shear * unit, middle, part);
    if (r.correlation > best.correlation) best = r;
    if (best.correlation >= least_correlation || !part.free_shear) break;
  }
  return best;
}

Readings follow_frames(const Film& film, const SlotMap& map, std::size_t strips, double pixel_rad, bool keep_frames,
                       const Part& part) {
  constexpr double furthest_px = 40, nearness_px = 50;
  struct Kept {
    double reading;
    Patterns view;
  };
  std::vector<Kept> kept;
  Readings out(film.profiles.size());
  Prediction prediction(film.interval_s);
  const auto view = [&](std::size_t i) {
    return Kept{out[i]->reading_rad, single_view(map, film.profiles[i], *out[i], 0.5 * pixel_rad, strips)};
  };
  for (std::size_t i = 0; i < film.profiles.size(); ++i) {
    if (kept.empty()) {
      out[i] = Registration{};
      out[i]->correlation = out[i]->gain = 1;
      kept.push_back(view(i));
      prediction.add(film.time_s[i], *out[i]);
      continue;
    }
    const Placement guess = prediction.at(film.time_s[i]);
    const auto nearest = std::min_element(kept.begin(), kept.end(), [&](const Kept& a, const Kept& b) {
      return std::abs(a.reading - guess.reading_rad) < std::abs(b.reading - guess.reading_rad);
    });
    const double range = std::min(prediction.doubt_px(film.time_s[i]), 3 * furthest_px) * pixel_rad;
    const Registration r = seek_near(film.profiles[i], map, nearest->view, pixel_rad, guess, range, part);
    if (r.correlation < least_correlation) continue;
    out[i] = r;
    prediction.add(film.time_s[i], r);
    if (!keep_frames)
      kept.front() = view(i);
    else if (std::abs(nearest->reading - r.reading_rad) > nearness_px * pixel_rad)
      kept.push_back(view(i));
  }
  return out;
}

Readings follow_code(const Film& film, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                     const Part& part) {
  Readings out(film.profiles.size());
  Prediction prediction(film.interval_s);
  for (std::size_t i = 0; i < film.profiles.size(); ++i) {
    const Profile& p = film.profiles[i];
    Registration r;
    if (!prediction.empty()) {
      const double range = std::min(40.0, prediction.doubt_px(film.time_s[i])) * pixel_rad;
      r = seek_near(p, map, patterns, pixel_rad, prediction.at(film.time_s[i]), range, part);
    }
    if (r.correlation < least_correlation) r = search_anywhere(p, map, patterns, pixel_rad, part);
    if (r.correlation < least_correlation) continue;
    out[i] = r;
    prediction.add(film.time_s[i], r);
  }
  return out;
}

Readings follow_chain(const Film& film, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                      const Readings& chain, double offset_rad, double range_rad, const Part& part) {
  Readings out(film.profiles.size());
  std::optional<double> away;
  double shear_away = 0;
  for (std::size_t i = 0; i < film.profiles.size(); ++i) {
    if (!chain[i]) continue;
    const Placement guess{chain[i]->reading_rad + away.value_or(offset_rad), chain[i]->shear_rad + shear_away};
    const Registration r =
        seek_near(film.profiles[i], map, patterns, pixel_rad, guess, away ? 2 * pixel_rad : range_rad, part);
    if (r.correlation < least_correlation) continue;
    out[i] = r;
    away = r.reading_rad - chain[i]->reading_rad;
    shear_away = r.shear_rad - chain[i]->shear_rad;
  }
  return out;
}

}  // namespace takt::dial
