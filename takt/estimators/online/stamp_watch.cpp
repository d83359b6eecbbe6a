// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/stamp_watch.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "takt/calibration/words.h"
#include "takt/math/median.h"

namespace takt::online {

namespace {

constexpr std::size_t remembered = 41;

}  // namespace

StampWatch::Fate StampWatch::observe(Stamp stamp) {
  if (!late_.empty() && stamp == late_.back()) return ++duplicates_, Fate::duplicate;
  if (!late_.empty() && stamp < late_.back()) return ++backward_, Fate::backward;
  if (!late_.empty() && step_s_ > 0) {
    const double step = seconds_since(late_.back(), stamp);
    if (step > 1.5 * step_s_) {
      ++gaps_, longest_gap_s_ = std::max(longest_gap_s_, step);
      missing_ += static_cast<std::size_t>(std::min(std::round(step / step_s_), 1e9)) - 1;
    }
  }
  ++good_;
  late_.push_back(stamp);
  if (late_.size() > remembered) late_.pop_front();
  // A full measure now and then: stamps come a thousand times a second.
  if (good_ < remembered || good_ % 16 == 0) measure();
  return Fate::good;
}

void StampWatch::measure() {
  if (late_.size() < 2) return;
  std::vector<double> steps;
  for (std::size_t i = 1; i < late_.size(); ++i) steps.push_back(seconds_since(late_[i - 1], late_[i]));
  step_s_ = median(steps);
  if (late_.size() < 12) return;
  // Places on the grid, dropped ones counted, and the line through them.
  double n = 0, sum_k = 0, sum_t = 0, sum_kk = 0, sum_kt = 0, k = 0;
  std::vector<std::pair<double, double>> points;
  for (std::size_t i = 0; i < late_.size(); ++i) {
    if (i > 0) k += std::max(1.0, std::round(steps[i - 1] / step_s_));
    const double t = seconds_since(late_.front(), late_[i]);
    points.emplace_back(k, t);
    n += 1, sum_k += k, sum_t += t, sum_kk += k * k, sum_kt += k * t;
  }
  const double slope = (n * sum_kt - sum_k * sum_t) / (n * sum_kk - sum_k * sum_k);
  const double start = (sum_t - slope * sum_k) / n;
  std::vector<double> off;
  for (const auto& [place, t] : points) off.push_back(std::abs(t - start - slope * place));
  const double sigma = 1.4826 * median(off) * std::sqrt(n / (n - 2));
  // Beyond a quarter of the step there is no grid to speak of.
  jitter_s_ = sigma < 0.25 * step_s_ ? sigma : 0;
}

std::vector<std::string> StampWatch::words() const {
  std::vector<std::string> out;
  if (duplicates_ > 0) out.push_back(fmt::format("{} stamps came twice and were left out", duplicates_));
  if (backward_ > 0) out.push_back(fmt::format("{} samples came after a later one and were left out", backward_));
  if (gaps_ > 0)
    out.push_back(fmt::format("{} gaps, about {} samples missing, the longest gap {}", gaps_, missing_,
                              rounded_time_words(longest_gap_s_)));
  if (jitter_s_ > 2e-4)
    out.push_back(fmt::format("stamps jitter by {} about an even grid", rounded_time_words(jitter_s_)));
  return out;
}

}  // namespace takt::online
