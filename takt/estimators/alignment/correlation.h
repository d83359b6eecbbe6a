// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/estimators/alignment/problem.h"
#include "takt/estimators/alignment/rate_grid.h"

namespace takt::alignment {

/// One place where the two signals fit.
struct Peak {
  double offset_s = 0;  ///< internal
  double sigma_s = 0;   ///< of the offset
  double r = 0;         ///< vector correlation under the best rotation, 0…1
  double evidence = 0;  ///< log likelihood ratio against no relation, nats
  Mat3 R_reference_sensor = Mat3::Identity();
};

/// The wide search: all axes at once under the best rotation, over every lag by FFT. [Mair2011] correlate |ω| first and
/// the axes after; fitting the rotation (Wahba's problem) at every lag costs little more and keeps the signs, without
/// which a weak or short motion is lost.
struct Correlation {
  std::vector<Peak> peaks;                        ///< best first, apart from each other by more than a lobe
  double lobe_s = 0;                              ///< half-width of a main lobe
  double significance = 0;                        ///< evidence that noise alone would reach once in a million searches
  double rival_margin = 0;                        ///< evidence of the first over the second; infinite without a second
  double searched_from_s = 0, searched_to_s = 0;  ///< internal offsets
  std::vector<double> curve_offset_s, curve_r;    ///< correlation, thinned for a plot
  std::string refusal;                            ///< why there is no peak at all; empty if there is one
};

/// Offsets are searched in [from, to] (internal seconds).
[[nodiscard]] Correlation correlate(const Problem& problem, const RateGrids& grids, double from_s, double to_s);

/// The peak refined and its drift followed through the recording, as the start for the fine methods.
[[nodiscard]] Coarse follow_drift(const Problem& problem, const RateGrids& grids, const Correlation& correlation);

}  // namespace takt::alignment
