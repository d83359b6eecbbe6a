// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/follow.h"

#include <algorithm>

#include "takt/signals/dial/self_calibration.h"

namespace takt::dial {
namespace {

/// Extrapolates the readings of the frames before, by their numbers.
class Prediction {
 public:
  void add(std::size_t index, double reading) {
    if (known_.size() == 3) known_.erase(known_.begin());
    known_.push_back({static_cast<double>(index), reading});
  }
  [[nodiscard]] bool empty() const { return known_.empty(); }
  /// Lagrange through the last three, two, or one; a gap leaves only what is safe.
  [[nodiscard]] double at(std::size_t index) const {
    const auto x = static_cast<double>(index);
    double sum = 0;
    for (const auto& a : known_) {
      double term = a.reading;
      for (const auto& b : known_)
        if (a.index != b.index) term *= (x - b.index) / (a.index - b.index);
      sum += term;
    }
    return sum;
  }
  /// How far the truth may be from it, in pixels.
  [[nodiscard]] double doubt_px(std::size_t index) const {
    const double gap = static_cast<double>(index) - known_.back().index;
    return (known_.size() < 3 ? 40 : 4) * gap * gap;
  }

 private:
  struct Known {
    double index, reading;
  };
  std::vector<Known> known_;
};

/// The sharpest of the whole pixels around a guess, then between the pixels.
Registration seek(const Profile& p, const SlotMap& map, const Patterns& patterns, double pixel_rad, double guess,
                  double range, const Part& part = {}) {
  const Candidate c = search_reading(p, map, patterns, guess - range, guess + range, 0.7 * pixel_rad, part);
  return register_profile(p, map, patterns, c.reading_rad, part);
}

}  // namespace

Readings follow_frames(const Film& film, const SlotMap& map, std::size_t levels, double pixel_rad, bool keep_frames) {
  constexpr double furthest_px = 40, nearness_px = 50;
  struct Kept {
    double reading;
    Patterns view;
  };
  std::vector<Kept> kept;
  Readings out(film.profiles.size());
  Prediction prediction;
  const auto view = [&](std::size_t i, double reading) {
    return Kept{reading, single_view(map, film.profiles[i], reading, 0.5 * pixel_rad, levels)};
  };
  for (std::size_t i = 0; i < film.profiles.size(); ++i) {
    if (kept.empty()) {
      kept.push_back(view(i, 0));
      out[i] = Registration{.correlation = 1, .gain = 1};
      prediction.add(film.index[i], 0);
      continue;
    }
    const double guess = prediction.at(film.index[i]);
    const auto nearest = std::min_element(kept.begin(), kept.end(), [&](const Kept& a, const Kept& b) {
      return std::abs(a.reading - guess) < std::abs(b.reading - guess);
    });
    const double range = std::min(prediction.doubt_px(film.index[i]), 3 * furthest_px) * pixel_rad;
    const Registration r = seek(film.profiles[i], map, nearest->view, pixel_rad, guess, range);
    if (r.correlation < least_correlation) continue;
    out[i] = r;
    prediction.add(film.index[i], r.reading_rad);
    if (!keep_frames)
      kept.front() = view(i, r.reading_rad);
    else if (std::abs(nearest->reading - r.reading_rad) > nearness_px * pixel_rad)
      kept.push_back(view(i, r.reading_rad));
  }
  return out;
}

Readings follow_code(const Film& film, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                     const Part& part) {
  Readings out(film.profiles.size());
  Prediction prediction;
  for (std::size_t i = 0; i < film.profiles.size(); ++i) {
    const Profile& p = film.profiles[i];
    Registration r;
    if (!prediction.empty()) {
      const double range = std::min(40.0, prediction.doubt_px(film.index[i])) * pixel_rad;
      r = seek(p, map, patterns, pixel_rad, prediction.at(film.index[i]), range, part);
    }
    if (r.correlation < least_correlation) {
      // Anywhere; by the middle of the view first, where a wrong scale does least.
      const Part middle{part.band, std::min(part.reach_rad, 100 * pixel_rad)};
      const Candidate c = search_reading(p, map, patterns, patterns.front().first_rad, patterns.front().last_rad(),
                                         0.8 * pixel_rad, middle);
      r = register_profile(p, map, patterns, c.reading_rad, part);
    }
    if (r.correlation < least_correlation) continue;
    out[i] = r;
    prediction.add(film.index[i], r.reading_rad);
  }
  return out;
}

Readings follow_chain(const Film& film, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                      const Readings& chain, double offset_rad, double range_rad) {
  Readings out(film.profiles.size());
  std::optional<double> away;
  for (std::size_t i = 0; i < film.profiles.size(); ++i) {
    if (!chain[i]) continue;
    const double guess = chain[i]->reading_rad + away.value_or(offset_rad);
    const Registration r = seek(film.profiles[i], map, patterns, pixel_rad, guess, away ? 2 * pixel_rad : range_rad);
    if (r.correlation < least_correlation) continue;
    out[i] = r;
    away = r.reading_rad - chain[i]->reading_rad;
  }
  return out;
}

}  // namespace takt::dial
