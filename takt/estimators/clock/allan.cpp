// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/allan.h"

#include <cmath>
#include <limits>

namespace takt {

std::vector<AllanPoint> allan_deviation(std::span<const PhaseSample> samples) {
  std::vector<AllanPoint> out;
  if (samples.size() < 4) return out;
  const double first = samples.front().t_s;
  const auto length = static_cast<std::size_t>(std::llround(samples.back().t_s - first)) + 1;
  if (length > 40 * samples.size()) return out;
  std::vector<double> phase(length, std::numeric_limits<double>::quiet_NaN());
  for (const PhaseSample& s : samples) phase[static_cast<std::size_t>(std::llround(s.t_s - first))] = s.phase_s;
  for (std::size_t m = 1; 3 * m < length; m *= 2) {
    double sum = 0;
    std::size_t n = 0;
    for (std::size_t i = 0; i + 2 * m < length; ++i) {
      const double d = phase[i + 2 * m] - 2 * phase[i + m] + phase[i];
      if (!std::isfinite(d)) continue;
      sum += d * d;
      ++n;
    }
    if (n < 2) continue;
    const auto tau = static_cast<double>(m);
    AllanPoint p{tau, std::sqrt(sum / (2 * static_cast<double>(n) * tau * tau)), 0};
    p.sigma = p.deviation / std::sqrt(2 * std::max(1.0, static_cast<double>(length) / tau / 2 - 1));
    out.push_back(p);
  }
  return out;
}

}  // namespace takt
