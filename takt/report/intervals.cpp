// SPDX-License-Identifier: Apache-2.0
#include "takt/report/intervals.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>

namespace takt::report {

Intervals::Intervals(const std::vector<Estimate>& answers) {
  low_s_ = std::numeric_limits<double>::infinity();
  high_s_ = -low_s_;
  for (const Estimate& e : answers) {
    if (!e.answered()) continue;
    if (count_++ == 0) base_ = *e.offset;
    const double at = to_seconds(*e.offset - base_), sigma = e.sigma_s.value_or(0);
    low_s_ = std::min(low_s_, at - sigma);
    high_s_ = std::max(high_s_, at + sigma);
  }
}

std::string Intervals::svg(const Estimate& e) const {
  if (!e.answered() || count_ < 2 || !(high_s_ > low_s_)) return "";
  const double at = to_seconds(*e.offset - base_), sigma = e.sigma_s.value_or(0);
  const auto percent = [&](double s) { return fmt::format("{:.2f}%", 4 + 92 * (s - low_s_) / (high_s_ - low_s_)); };
  return fmt::format(
      R"(<svg height="14" aria-hidden="true"><line x1="{}" x2="{}" y1="7" y2="7"/><circle cx="{}" cy="7" r="3.5"/></svg>)",
      percent(at - sigma), percent(at + sigma), percent(at));
}

}  // namespace takt::report
