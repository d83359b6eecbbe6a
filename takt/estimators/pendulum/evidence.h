// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/calibration/evidence.h"
#include "takt/estimators/pendulum/joint_spline.h"
#include "takt/estimators/pendulum/per_swing.h"

namespace takt::pendulum {

/// Angle and rate with their fits, the delay of each swing by all three estimators, and the residuals.
[[nodiscard]] Evidence evidence(const SplineFit& spline, const std::vector<SwingDelay>& extrema,
                                const std::vector<SwingDelay>& damped, const Swings& swings);

}  // namespace takt::pendulum
