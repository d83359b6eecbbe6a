// SPDX-License-Identifier: Apache-2.0
// Noise levels of a clock and of its pulses, from the data alone: maximum likelihood by a simplex search on logarithms.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "takt/estimators/clock/clock_model.h"
#include "takt/math/median.h"

namespace takt {

namespace {

using Point = std::vector<double>;

constexpr std::size_t least_to_wander = 256;  // so many samples show a wander of their own
constexpr double earned = 2;                  // by so much its unknowns must be likelier
// Every crystal's rate walks. Likelihood alone often puts that walk at nothing when it is too slow to be seen yet, and
// sigma is too small then: a prior of q2 to this power keeps it off zero, and is soon outweighed.
constexpr double walk_prior = 0.25;
const double little = std::log(1e-3);

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

/// The sixth unknown is the wander's correlation time, unless that is given.
ClockNoise noise_of(const Point& p, double least_white_s2, std::optional<double> wander_time_s = {}) {
  ClockNoise n;
  n.white_phase_s2 = least_white_s2 + clamped_exp(p[0], 1e-24, 1e2);
  n.white_frequency = clamped_exp(p[1], 1e-30, 1e-6);
  n.walk_frequency = clamped_exp(p[2], 1e-34, 1e-8);
  n.walk_drift = clamped_exp(p[3], 1e-42, 1e-12);
  if (p.size() > 4) {
    n.wander_s2 = clamped_exp(p[4], 1e-22, 1e2);
    n.wander_time_s = wander_time_s ? *wander_time_s : clamped_exp(p[5], 3, 3e4);
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

/// Noise levels as logarithms, and what they cost.
struct Found {
  Point at;
  ClockNoise noise;
  double cost = 0;  // −log of likelihood and prior
};

/// Looks for noise levels of one row of samples. A wander's correlation time is an unknown unless it is given.
class Search {
 public:
  Search(std::span<const PhaseSample> samples, double least_white_s2) : s_(samples), least_white_s2_(least_white_s2) {}

  [[nodiscard]] Found from(const Point& start, double size, int evaluations,
                           std::optional<double> wander_time_s = {}) const {
    const auto levels = [&](const Point& p) { return noise_of(p, least_white_s2_, wander_time_s); };
    const auto cost = [&](const Point& p) {
      const ClockNoise n = levels(p);
      return noise_cost(s_, n) - walk_prior * std::log(n.walk_frequency);
    };
    Found out;
    out.at = least(start, size, evaluations, cost, out.cost);
    out.noise = levels(out.at);
    return out;
  }

 private:
  std::span<const PhaseSample> s_;
  double least_white_s2_;
};

/// Where a search for the oscillator's own levels may begin.
std::vector<Point> starts(std::span<const PhaseSample> s, double white, double least_white_s2) {
  const std::size_t lag = std::min<std::size_t>(32, s.size() / 4);
  const double t = static_cast<double>(lag), much = std::max(second_difference_var(s, lag) - 6 * white, 0.01 * white);
  // What the second differences over `lag` would be for each noise alone: 2·q1·t, 2/3·q2·t³, about q3·t⁵/2.
  const double w = std::log(std::max(white - least_white_s2, 0.1 * white));
  const double q1 = std::log(much / (2 * t)), q2 = std::log(much / (t * t * t)), q3 = std::log(much / std::pow(t, 5));
  return {{w, q1, q2 + little, std::log(1e-30)},
          {w, q1 + 2 * little, q2 + std::log(1.5), q3 + little},
          {w, q1 + 2 * little, q2 + little, q3 + std::log(2.0)}};
}

/// Do the pulses wander by themselves? One answer for each correlation time that receivers have.
std::vector<Found> wandering(const Search& search, const Found& calm) {
  std::vector<Found> out;
  for (const double time_s : {10.0, 30.0, 100.0, 300.0, 1000.0}) {
    Point start = calm.at;
    start[1] += 2 * little;
    start[2] += little;
    // Over short times a wander is as white frequency noise.
    start.push_back(std::log(std::max(0.5 * calm.noise.white_frequency * time_s, 0.01 * calm.noise.white_phase_s2)));
    out.push_back(search.from(start, 1.5, 120, time_s));
  }
  return out;
}

/// By how much pulses may wander more than the chosen levels say: over all that the data leave open, by their odds.
double unresolved_s2(const std::vector<Found>& open, const Found& chosen) {
  double weights = 0, sum = 0;
  for (const Found& f : open) {
    const double weight = std::exp(std::min(chosen.cost - f.cost, 50.0));
    weights += weight;
    sum += weight * std::max(f.noise.wander_s2 - chosen.noise.wander_s2, 0.0);
  }
  return sum / weights;
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
  Found rough;
  rough.cost = 1e300;
  for (const Point& start : starts(part, white, least_white_s2)) {
    const Found f = Search(part, least_white_s2).from(start, 1.5, 120);
    if (f.cost < rough.cost) rough = f;
  }
  const Search search(all, least_white_s2);
  const Found calm = search.from(rough.at, 1.5, all.size() > part.size() ? 120 : 80);
  if (all.size() < least_to_wander) return calm.noise;

  std::vector<Found> open = wandering(search, calm);
  open.push_back(calm);
  // A wander that lasts a third of the samples is not told from a rate: it stays open, but is not believed.
  const double longest_s = (all.back().t_s - all.front().t_s) / 3;
  Found chosen = calm;
  for (const Found& f : open)
    if (f.noise.wander_s2 > 0 && f.noise.wander_time_s < longest_s &&
        f.cost < std::min(chosen.cost, calm.cost - earned))
      chosen = f;
  ClockNoise out = chosen.noise;
  if (out.wander_s2 > 0) {
    Point start = chosen.at;
    start.push_back(std::log(out.wander_time_s));
    out = search.from(start, 1.0, 120).noise;
  }
  out.unresolved_s2 = unresolved_s2(open, chosen);
  return out;
}

}  // namespace takt
