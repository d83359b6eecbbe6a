// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/sample_times.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "takt/math/median.h"

namespace takt {

SampleTimes::SampleTimes(std::vector<double> times_s, double gap_factor) : t_(std::move(times_s)) {
  if (t_.size() < 2)
    throw std::invalid_argument("SampleTimes: at least 2 samples are needed, not " + std::to_string(t_.size()));
  std::vector<double> steps(t_.size() - 1);
  for (std::size_t i = 0; i + 1 < t_.size(); ++i) {
    steps[i] = t_[i + 1] - t_[i];
    if (!(steps[i] > 0) || !std::isfinite(steps[i]))
      throw std::invalid_argument("SampleTimes: sample " + std::to_string(i + 1) +
                                  " is not later than the one before, or not finite");
  }
  median_step_ = median(steps);
  stretch_.assign(t_.size(), 0);
  for (std::size_t i = 1; i < t_.size(); ++i)
    stretch_[i] = stretch_[i - 1] + (steps[i - 1] <= gap_factor * median_step_ ? 0 : 1);
}

std::size_t SampleTimes::interval(double t) const {
  if (!(t >= t_.front() && t <= t_.back()))
    throw std::out_of_range("SampleTimes: t = " + std::to_string(t) + " s is outside [" + std::to_string(t_.front()) +
                            ", " + std::to_string(t_.back()) + "]");
  // Nearly uniform samples: guess from the mean step, then walk; fall back to bisection after a few steps.
  const std::size_t last = t_.size() - 2;
  const double mean_step = (t_.back() - t_.front()) / static_cast<double>(t_.size() - 1);
  std::size_t j = std::min(last, static_cast<std::size_t>((t - t_.front()) / mean_step));
  for (int i = 0; i < 8; ++i) {
    if (t < t_[j])
      --j;
    else if (j < last && t >= t_[j + 1])
      ++j;
    else
      return j;
  }
  const auto after = std::upper_bound(t_.begin(), t_.end(), t);
  return std::min(last, static_cast<std::size_t>(after - t_.begin()) - 1);
}

bool SampleTimes::covers(double t0, double t1) const {
  if (!(t0 >= t_.front() && t1 <= t_.back() && t0 <= t1)) return false;
  const std::size_t first = interval(t0);
  std::size_t last = interval(t1);
  if (t1 > t_[last]) ++last;
  return together(first, last);
}

}  // namespace takt
