// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/repairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

#include "takt/math/median.h"

namespace takt::pendulum {
namespace {

constexpr double sigma_of_median = 1.4826;

/// Steps of one axis from reading to reading.
struct Steps {
  double typical = 0, smallest = 0;  ///< of those that are not zero
  double equal_share = 0;
};
Steps steps_of(const std::vector<Vec3>& readings, int axis) {
  std::vector<double> moved;
  for (std::size_t i = 1; i < readings.size(); ++i)
    if (const double step = std::abs(readings[i][axis] - readings[i - 1][axis]); step > 0) moved.push_back(step);
  Steps s;
  s.equal_share = 1 - static_cast<double>(moved.size()) / static_cast<double>(readings.size() - 1);
  if (moved.empty()) return s;
  s.smallest = *std::min_element(moved.begin(), moved.end());
  s.typical = median(std::move(moved));
  return s;
}

/// The `places`' value at time `t` from their interpolating polynomial, as weights of their values.
template <std::size_t n>
std::array<double, n> lagrange(const std::array<double, n>& times, double t) {
  std::array<double, n> weight;
  for (std::size_t k = 0; k < n; ++k) {
    weight[k] = 1;
    for (std::size_t j = 0; j < n; ++j)
      if (j != k) weight[k] *= (t - times[j]) / (times[k] - times[j]);
  }
  return weight;
}

double median_step(const std::vector<double>& time_s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  return median(std::move(steps));
}

/// How far each of the kept readings is from the cubic through its neighbours, in units of what white noise of the same
/// size would give; 0 beside a gap and at the ends.
std::vector<double> distances(const std::vector<double>& time_s, const std::vector<double>& value,
                              const std::vector<std::size_t>& kept, double widest_s) {
  std::vector<double> out(kept.size(), 0);
  for (std::size_t k = 2; k + 2 < kept.size(); ++k) {
    const std::array<std::size_t, 4> beside{kept[k - 2], kept[k - 1], kept[k + 1], kept[k + 2]};
    if (time_s[beside[3]] - time_s[beside[0]] > widest_s) continue;
    std::array<double, 4> times;
    for (std::size_t j = 0; j < 4; ++j) times[j] = time_s[beside[j]];
    const auto weight = lagrange(times, time_s[kept[k]]);
    double expected = 0, variance = 1;
    for (std::size_t j = 0; j < 4; ++j) expected += weight[j] * value[beside[j]], variance += weight[j] * weight[j];
    out[k] = std::abs(value[kept[k]] - expected) / std::sqrt(variance);
  }
  return out;
}

/// A stray spoils its neighbours' cubics too: of those beside each other only the furthest is one.
std::vector<bool> furthest_beyond(double limit, const std::vector<double>& distance) {
  std::vector<bool> out(distance.size(), false);
  for (std::size_t k = 2; k + 2 < distance.size(); ++k)
    out[k] =
        distance[k] > limit && distance[k] >= *std::max_element(distance.begin() + static_cast<std::ptrdiff_t>(k) - 2,
                                                                distance.begin() + static_cast<std::ptrdiff_t>(k) + 3);
  return out;
}

}  // namespace

std::vector<bool> repeats(const std::vector<Vec3>& readings) {
  std::vector<bool> same(readings.size(), false);
  if (readings.size() < 2) return same;
  double by_chance = 1;
  Steps liveliest;
  for (int axis = 0; axis < 3; ++axis) {
    const Steps s = steps_of(readings, axis);
    by_chance *= s.equal_share;
    if (s.typical > liveliest.typical) liveliest = s;
  }
  std::size_t found = 0;
  for (std::size_t i = 1; i < readings.size(); ++i) found += same[i] = readings[i] == readings[i - 1];
  // Counts fine enough never repeat in noise; coarse ones do, but not in all axes at once.
  const bool fine = liveliest.typical >= 8 * liveliest.smallest && liveliest.smallest > 0;
  const double expected = by_chance * static_cast<double>(readings.size() - 1);
  if (!fine && static_cast<double>(found) < 3 * expected + 20) same.assign(readings.size(), false);
  return same;
}

std::vector<bool> strays(const std::vector<double>& time_s, const std::vector<double>& value) {
  constexpr double far = 20, widest_steps = 8;
  std::vector<bool> out(time_s.size(), false);
  if (time_s.size() < 20) return out;
  const double widest_s = widest_steps * median_step(time_s);
  std::vector<std::size_t> kept(time_s.size());
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  for (std::size_t before = 0; before != kept.size();) {
    before = kept.size();
    const std::vector<double> distance = distances(time_s, value, kept, widest_s);
    const std::vector<bool> stray = furthest_beyond(far * sigma_of_median * median(distance), distance);
    std::vector<std::size_t> left;
    for (std::size_t k = 0; k < kept.size(); ++k)
      if (stray[k])
        out[kept[k]] = true;
      else
        left.push_back(kept[k]);
    kept = std::move(left);
    if (10 * (time_s.size() - kept.size()) > time_s.size()) return std::vector<bool>(time_s.size(), false);
  }
  return out;
}

double noise_of(const std::vector<double>& time_s, const std::vector<double>& value) {
  constexpr std::size_t points = 7;
  std::vector<double> differences;
  for (std::size_t i = 0; i + points <= time_s.size(); ++i) {
    double difference = 0, squares = 0;
    for (std::size_t k = i; k < i + points; ++k) {
      double weight = 1;
      for (std::size_t j = i; j < i + points; ++j)
        if (j != k) weight /= (time_s[k] - time_s[j]) / (time_s[i + points - 1] - time_s[i]);
      difference += weight * value[k];
      squares += weight * weight;
    }
    differences.push_back(std::abs(difference) / std::sqrt(squares));
  }
  return differences.empty() ? 0 : sigma_of_median * median(std::move(differences));
}

}  // namespace takt::pendulum
