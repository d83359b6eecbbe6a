// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/jump.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "takt/math/median.h"

namespace takt::pendulum {
namespace {

constexpr std::size_t fewest = 8;
/// Less than this spoils no result, and data without noise (simulated, filtered) show the fit's own small errors.
constexpr double smallest_s = 20e-6;
constexpr std::size_t fewest_a_side = 3;

/// Sums of the delays in units of the scatter, for a constant or a line through them.
struct Sums {
  double w = 0, t = 0, d = 0, tt = 0, td = 0, dd = 0;

  void add(double time, double delay, double weight) {
    w += weight, t += weight * time, d += weight * delay;
    tt += weight * time * time, td += weight * time * delay, dd += weight * delay * delay;
  }
  [[nodiscard]] double mean() const { return d / w; }
  [[nodiscard]] double about_mean() const { return std::max(0.0, dd - d * d / w); }
  [[nodiscard]] double about_line() const {
    const double across = td - t * d / w, along = tt - t * t / w;
    return std::max(0.0, about_mean() - (along > 0 ? across * across / along : 0));
  }
};

Sums sums_of(std::span<const StretchDelay> stretches, double epoch_s, double scatter) {
  Sums s;
  for (const StretchDelay& x : stretches)
    s.add(x.middle_s - epoch_s, x.delay_s, 1 / (x.sigma_s * x.sigma_s * scatter * scatter));
  return s;
}

/// Of one stretch against its neighbour, in units of their σ.
double scatter_of_neighbours(const std::vector<StretchDelay>& s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < s.size(); ++i)
    steps.push_back(std::abs(s[i].delay_s - s[i - 1].delay_s) / std::hypot(s[i].sigma_s, s[i - 1].sigma_s));
  return 1.4826 * median(std::move(steps));
}

struct Jump {
  std::size_t first_after = 0;
  double size_s = 0, sigma_s = 0;
  double squares = 1e300;  ///< that it leaves
};
Jump best_jump(const std::vector<StretchDelay>& stretches, double scatter) {
  const std::span<const StretchDelay> all(stretches);
  Jump best;
  for (std::size_t k = fewest_a_side; k + fewest_a_side <= all.size(); ++k) {
    const Sums before = sums_of(all.first(k), all.front().middle_s, scatter),
               after = sums_of(all.subspan(k), all.front().middle_s, scatter);
    const double squares = before.about_mean() + after.about_mean();
    if (squares < best.squares)
      best = {k, after.mean() - before.mean(), std::sqrt(1 / before.w + 1 / after.w), squares};
  }
  return best;
}

}  // namespace

std::string refuse_stretches(const std::vector<StretchDelay>& stretches) {
  if (stretches.size() < fewest) return "";
  const double scatter = scatter_of_neighbours(stretches);
  if (!(scatter > 0)) return "";
  const Sums all = sums_of(stretches, stretches.front().middle_s, scatter);
  const double left_by_line = all.about_line();
  const Jump jump = best_jump(stretches, scatter);
  // Of some forty places for a jump the best one gains up to ten by chance.
  if (std::abs(jump.size_s) > std::max(6 * jump.sigma_s, smallest_s) && left_by_line - jump.squares > 16) {
    const double before = stretches[jump.first_after - 1].middle_s, after = stretches[jump.first_after].middle_s;
    return fmt::format(
        "the delay jumps by {:.3f} ± {:.3f} ms at {:.1f} s: a clock stepped, or frames or samples were lost while "
        "their "
        "stamps went on; take what is before it (--to {:.1f}) or after it (--from {:.1f})",
        jump.size_s * 1e3, jump.sigma_s * 1e3, 0.5 * (before + after), std::max(0.0, before - 0.5), after + 0.5);
  }
  const double wander = std::sqrt(left_by_line / static_cast<double>(stretches.size() - 2));
  if (wander > 4 && std::sqrt(left_by_line / all.w) > smallest_s)
    return fmt::format(
        "the delay wanders: over the recording the swings' delays scatter {:.0f} times more than from one to the next: "
        "were frames or samples lost again and again while their stamps went on?",
        wander);
  return "";
}

}  // namespace takt::pendulum
