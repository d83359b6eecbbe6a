// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/pendulum/coarse.h"
#include "takt/estimators/pendulum/harmonic_fit.h"
#include "takt/estimators/pendulum/swings.h"

namespace takt::pendulum {

/// What one swing says.
struct SwingDelay {
  Swing swing;
  double delay_s = 0;
  double sigma_s = 0;  ///< 0 where the method gives none
  double damping_per_s = 0;
  bool outlier = false;
  Harmonic angle, rate;  ///< the fits, where the method has them
};

/// As published: [Fu2021] eq. 10 on the angle and on the rate of each swing, then Δt = t2 − t3 + T/4 (eq. 11).
/// The quarter period takes the rate to lead the angle by exactly 90°, which a damped swing's does not: eq. 9 drops
/// the phase β, tan β = δ/ω', and Δt comes out β/ω' too small.
[[nodiscard]] std::vector<SwingDelay> extrema_delays(const Signals& signals, const Coarse& coarse,
                                                     const std::vector<Swing>& swings);

/// The same swing by swing with a damped wave: θ = Re Z·e^{λt}, hence ω = Re λ·Z·e^{λt} with λ = −δ + iω', exactly.
[[nodiscard]] std::vector<SwingDelay> damped_delays(const Signals& signals, const Coarse& coarse,
                                                    const std::vector<Swing>& swings);

/// Marks outliers (beyond 3 robust standard deviations of the median, [Fu2021] step 5) and averages the others;
/// the uncertainty is that of a mean, from the scatter.
[[nodiscard]] Estimate average(std::string method, std::vector<SwingDelay>& delays, const Signals& signals);

/// How much smaller than the truth `extrema` comes out for the damping that `damped` found: mean of β/ω'.
[[nodiscard]] double neglected_phase_s(const std::vector<SwingDelay>& damped);

}  // namespace takt::pendulum
