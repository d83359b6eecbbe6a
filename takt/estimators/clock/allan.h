// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <vector>

#include "takt/estimators/clock/clock_model.h"

namespace takt {

struct AllanPoint {
  double tau_s = 0;
  double deviation = 0;  ///< s/s
  double sigma = 0;      ///< of the deviation, from the number of independent stretches
};
/// Overlapping Allan deviation of phase samples a second apart, at octaves of tau [Riley2008]. Seconds without a sample
/// take no part.
[[nodiscard]] std::vector<AllanPoint> allan_deviation(std::span<const PhaseSample> samples);

}  // namespace takt
