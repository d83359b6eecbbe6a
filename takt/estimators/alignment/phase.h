// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/estimators/alignment/problem.h"

namespace takt::alignment {

/// Offset as the slope of the cross-spectrum's phase, each frequency weighted by its coherence [Mair2011].
struct PhaseFit {
  bool answered = false;
  double offset_s = 0;  ///< internal, at the coarse centre
  double sigma_s = 0;
  std::vector<double> frequency_hz, coherence, phase_rad;  ///< after the coarse alignment
};

/// Needs a coarse offset good to a fraction of a period of the fastest coherent motion.
[[nodiscard]] PhaseFit fit_phase(const Problem& problem, const Coarse& start);

}  // namespace takt::alignment
