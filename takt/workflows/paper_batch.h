// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>

#include "takt/calibration/estimate.h"
#include "takt/simulation/pendulum_rig.h"

/// The column that [Fu2021] fills with Kalibr: the rig's camera and IMU taken off the pendulum, moved freely before a
/// board and calibrated by `takt calibrate`'s batch method.
namespace takt::paper {

/// ms.
struct BatchDelay {
  double delay = NAN, sigma = NAN;
  double truth = NAN;  ///< the rig's own, plus half an exposure where stamps are its start, less where its end
  Verdict verdict = Verdict::refused;
};

/// One short recording at the level of corners: a 6 × 6 AprilGrid, 50 frames/s, the gyro's noise and output rate. The
/// IMU's whole delay is a pure one: at free motion's 0.6 to 3 Hz its low-pass delays all alike to a few µs. Stamps are
/// taken for the middle of the exposure, as the paper takes them, whatever they are.
[[nodiscard]] BatchDelay batch_delay(const PendulumRig& rig, std::uint64_t seed);

}  // namespace takt::paper
