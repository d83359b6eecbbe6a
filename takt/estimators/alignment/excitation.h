// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/estimators/alignment/problem.h"

namespace takt::alignment {

/// How much the two sides turn, above their own noise.
struct Excitation {
  Vec3 sensor_rms = Vec3::Zero();  ///< rad/s along the principal axes of its motion, largest first
  Vec3 reference_rms = Vec3::Zero();
  double sensor_noise = 0;     ///< rad/s: what one step of the sensor claims as its own error
  double reference_noise = 0;  ///< rad/s over a step of the sensor

  [[nodiscard]] bool sensor_still() const;
  [[nodiscard]] bool reference_still() const;
};
[[nodiscard]] Excitation measure_excitation(const Problem& problem);

}  // namespace takt::alignment
