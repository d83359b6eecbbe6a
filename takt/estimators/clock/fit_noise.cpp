// SPDX-License-Identifier: Apache-2.0
// Noise levels of a clock and of its pulses, from the data alone: maximum likelihood by a simplex search on logarithms.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "takt/estimators/clock/clock_model.h"
#include "takt/math/median.h"

namespace takt {

namespace {

using Point = std::vector<double>;

/// Nelder and Mead's simplex; small and without derivatives, for a handful of unknowns.
template <class Cost>
Point least(Point start, double size, int evaluations, const Cost& cost, double& best_cost) {
  struct Vertex {
    Point at;
    double cost;
  };
  std::vector<Vertex> simplex{{start, cost(start)}};
  for (std::size_t i = 0; i < start.size(); ++i) {
    Point p = start;
    p[i] += size;
    simplex.push_back({p, cost(p)});
  }
  int used = static_cast<int>(simplex.size());
  const auto by_cost = [](const Vertex& a, const Vertex& b) { return a.cost < b.cost; };
  std::sort(simplex.begin(), simplex.end(), by_cost);
  while (used < evaluations && simplex.back().cost - simplex.front().cost > 0.02) {
    Point middle(start.size(), 0.0);
    for (std::size_t v = 0; v + 1 < simplex.size(); ++v)
      for (std::size_t i = 0; i < middle.size(); ++i)
        middle[i] += simplex[v].at[i] / static_cast<double>(middle.size());
    const auto along = [&](double f) {
      Point p = middle;
      for (std::size_t i = 0; i < p.size(); ++i) p[i] += f * (simplex.back().at[i] - middle[i]);
      ++used;
      return Vertex{p, cost(p)};
    };
    Vertex tried = along(-1);
    if (tried.cost < simplex.front().cost) {
      const Vertex further = along(-2);
      if (further.cost < tried.cost) tried = further;
    } else if (tried.cost >= simplex[simplex.size() - 2].cost) {
      tried = along(tried.cost < simplex.back().cost ? -0.5 : 0.5);
      if (tried.cost >= simplex.back().cost) {
        for (std::size_t v = 1; v < simplex.size(); ++v) {
          for (std::size_t i = 0; i < middle.size(); ++i)
            simplex[v].at[i] = 0.5 * (simplex[v].at[i] + simplex[0].at[i]);
          simplex[v].cost = cost(simplex[v].at);
          ++used;
        }
        std::sort(simplex.begin(), simplex.end(), by_cost);
        continue;
      }
    }
    simplex.back() = tried;
    std::sort(simplex.begin(), simplex.end(), by_cost);
  }
  best_cost = simplex.front().cost;
  return simplex.front().at;
}

double clamped_exp(double log, double low, double high) {
  return std::exp(std::clamp(log, std::log(low), std::log(high)));
}

ClockNoise noise_of(const Point& p, double least_white_s2) {
  ClockNoise n;
  n.white_phase_s2 = least_white_s2 + clamped_exp(p[0], 1e-24, 1e2);
  n.white_frequency = clamped_exp(p[1], 1e-30, 1e-6);
  n.walk_frequency = clamped_exp(p[2], 1e-34, 1e-8);
  n.walk_drift = clamped_exp(p[3], 1e-42, 1e-12);
  if (p.size() > 4) {
    n.wander_s2 = clamped_exp(p[4], 1e-22, 1e2);
    n.wander_time_s = clamped_exp(p[5], 3, 3e4);
  }
  return n;
}

/// Robust variance of second differences over `lag` samples.
double second_difference_var(std::span<const PhaseSample> s, std::size_t lag) {
  std::vector<double> d;
  for (std::size_t i = 2 * lag; i < s.size(); ++i)
    d.push_back(std::abs(s[i].phase_s - 2 * s[i - lag].phase_s + s[i - 2 * lag].phase_s));
  if (d.empty()) return 0;
  const double sigma = 1.4826 * median(std::move(d));
  return sigma * sigma;
}

}  // namespace

ClockNoise fit_noise(std::span<const PhaseSample> samples, double quantum_s, std::size_t most) {
  const double least_white_s2 = std::max(quantum_s * quantum_s / 12 * 0.25, 1e-24);
  ClockNoise fallback;
  fallback.white_phase_s2 = std::max(quantum_s * quantum_s / 6, 1e-16);
  // So few samples say no more than how they scatter, and that roughly.
  if (samples.size() < 16) {
    fallback.white_phase_s2 = std::max(fallback.white_phase_s2, 2 * second_difference_var(samples, 1) / 6);
    return fallback;
  }
  const std::span<const PhaseSample> all = samples.subspan(samples.size() - std::min(most, samples.size()));
  const std::span<const PhaseSample> part = all.subspan(all.size() - std::min<std::size_t>(1024, all.size()));

  const double white = std::max(second_difference_var(part, 1) / 6, least_white_s2);
  const auto excess = [&](std::size_t lag) {
    return std::max(second_difference_var(part, lag) - 6 * white, 0.01 * white);
  };
  const std::size_t lag = std::min<std::size_t>(32, part.size() / 4);
  const double t = static_cast<double>(lag);
  // What the second differences over `lag` would be for each noise alone: 2·q1·t, 2/3·q2·t³, about q3·t⁵/2.
  const double w = std::log(std::max(white - least_white_s2, 0.1 * white)), much = excess(lag);
  const double none = std::log(1e-30), little = std::log(1e-3);
  const std::vector<Point> starts{{w, std::log(much / (2 * t)), std::log(much / (t * t * t)) + little, none},
                                  {w, std::log(much / (2 * t)) + 2 * little, std::log(1.5 * much / (t * t * t)),
                                   std::log(much / std::pow(t, 5)) + little},
                                  {w, std::log(much / (2 * t)) + 2 * little, std::log(much / (t * t * t)) + little,
                                   std::log(2 * much / std::pow(t, 5))}};
  const auto cost_on = [&](std::span<const PhaseSample> s) {
    return [&, s](const Point& p) { return noise_cost(s, noise_of(p, least_white_s2)); };
  };
  Point best;
  double best_cost = 1e300;
  for (const Point& start : starts) {
    double cost = 0;
    const Point found = least(start, 1.5, 120, cost_on(part), cost);
    if (cost < best_cost) {
      best_cost = cost;
      best = found;
    }
  }
  double plain_cost = 0;
  best = least(best, 1.5, all.size() > part.size() ? 120 : 80, cost_on(all), plain_cost);
  // Do the pulses wander by themselves? Two unknowns more must earn it.
  constexpr double earned = 2;
  const double without_cost = plain_cost;
  double unresolved_s2 = 0;
  if (all.size() >= 256) {
    const Point plain = best;
    for (const double time_s : {30.0, 300.0, 1000.0}) {
      // A wander that lasts a third of the recording is a rate.
      const double longest_s = (all.back().t_s - all.front().t_s) / 3;
      if (time_s > longest_s) continue;
      Point with = plain;
      with[1] += 2 * little;
      with[2] += little;
      with.push_back(std::log(white));
      with.push_back(std::log(time_s));
      double cost = 0;
      const Point found = least(with, 1.5, 220, cost_on(all), cost);
      const ClockNoise other = noise_of(found, least_white_s2);
      if (other.wander_time_s < longest_s)
        unresolved_s2 =
            std::max(unresolved_s2, other.wander_s2 / (1 + std::exp(std::min(cost + earned - without_cost, 50.0))));
      if (cost < plain_cost - earned) {
        plain_cost = cost + earned;  // from here on it competes with its like
        best = found;
      }
    }
  }
  ClockNoise out = noise_of(best, least_white_s2);
  if (out.wander_s2 == 0) out.unresolved_s2 = unresolved_s2;
  return out;
}

}  // namespace takt
