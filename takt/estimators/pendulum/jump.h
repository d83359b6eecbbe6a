// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/estimators/pendulum/joint_spline.h"

namespace takt::pendulum {

/// Why the stretches' delays are no one number, nor a line: they jump (a clock that stepped, frames lost while their
/// stamps went on) or wander. Judged by how they scatter from one stretch to the next, for a jump spoils the fit's own
/// noise, and with it every σ. Empty where they hold, and where there are fewer than eight.
[[nodiscard]] std::string refuse_stretches(const std::vector<StretchDelay>& stretches);

}  // namespace takt::pendulum
