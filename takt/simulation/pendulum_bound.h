// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/simulation/pendulum_rig.h"

namespace takt {

/// The Cramér–Rao bound on the delay (s, one σ) from the readings of one IMU between two instants after the release.
/// Of the motion nothing is taken as known but the pendulum's equation: state at the start, ω0, δ, μ, c, the dial's
/// zero, and the gyro's scale and bias are unknowns too. Gyro noise counts with its density at the swing's frequency.
[[nodiscard]] double pendulum_bound_s(const PendulumRig& rig, const GyroModel& gyro, double from_s, double to_s);

}  // namespace takt
