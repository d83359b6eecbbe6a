// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/calibration/evidence.h"
#include "takt/estimators/alignment/correlation.h"
#include "takt/estimators/alignment/likelihood.h"
#include "takt/estimators/alignment/phase.h"

/// The plots of an alignment, as plain data.
namespace takt::alignment {

[[nodiscard]] Panel correlation_panel(const Problem& problem, const Correlation& correlation);
/// Both rates over time, on the sensor's stamps, as they come and with the offset applied.
[[nodiscard]] Panel rates_panel(const Problem& problem, double offset_s, double drift, double centre_s,
                                const Mat3& R_reference_sensor, bool after);
[[nodiscard]] Panel coherence_panel(const PhaseFit& fit);
[[nodiscard]] Panel residuals_panel(const LikelihoodFit& fit);
[[nodiscard]] Panel windows_panel(const LikelihoodFit& fit);

}  // namespace takt::alignment
