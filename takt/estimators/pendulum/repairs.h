// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/motion/rotation.h"

/// Readings that are no measurement of their own, found without a model of the motion.
namespace takt::pendulum {

/// Readings that repeat the one before under a new stamp: a driver that asks faster than the sensor measures, a frame
/// that was handed over twice. Each would delay the signal. Where a sensor's counts are so coarse that neighbours are
/// equal by chance, they are left alone.
[[nodiscard]] std::vector<bool> repeats(const std::vector<Vec3>& readings);

/// Readings far from the cubic through their four neighbours: 20 times as far as the others. None where a tenth or
/// more would be, for then they are not strays but the signal. Times (s) ascend.
[[nodiscard]] std::vector<bool> strays(const std::vector<double>& time_s, const std::vector<double>& value);

/// Standard deviation of one reading from sixth divided differences, in which a swing leaves nothing of itself. Times
/// (s) ascend and may be irregular; 0 where there are too few.
[[nodiscard]] double noise_of(const std::vector<double>& time_s, const std::vector<double>& value);

}  // namespace takt::pendulum
