// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/motion/gyro_curve.h"
#include "takt/streams/rotation_signal.h"
#include "takt/streams/streams.h"

namespace takt::alignment {

/// A rotation increment in seconds after the sensor's epoch.
struct Step {
  double t0, t1;
  Vec3 rotation;
  Vec3 apparent;
  Mat3 information;
};

/// Bearings over a step; `matches` points into the signal.
struct PairStep {
  double t0, t1;
  const std::vector<BearingMatch>* matches;
};

/// Sensor and reference, each in seconds after its own first stamp, so that doubles keep their digits whatever the
/// clocks count from. Sought: t_reference_s = t_sensor_s + offset + drift·(t_sensor_s − centre).
struct Problem {
  Problem(const RotationSignal& signal, const ImuStream& reference_imu);

  const RotationSignal& signal;
  Stamp sensor_epoch;
  Stamp reference_epoch;
  std::vector<Step> steps;      ///< measured ones only, in order of time
  std::vector<PairStep> pairs;  ///< chain by chain; empty where there are no bearings
  GyroCurve reference;
  double step_s;  ///< median length of a step

  /// reference_epoch − sensor_epoch: what to add to an internal offset to get the one between the stamps.
  [[nodiscard]] Duration between_epochs() const {
    return reference_epoch.time_since_epoch() - sensor_epoch.time_since_epoch();
  }
};

/// What all methods refine: where they start.
struct Coarse {
  double offset_s = 0;  ///< internal (epoch to epoch), at `centre_s`
  double drift = 0;
  double centre_s = 0;  ///< sensor seconds
  Mat3 R_reference_sensor = Mat3::Identity();
  double lobe_s = 0;     ///< half-width of the correlation's main lobe
  double log_focal = 0;  ///< log of the true focal length over the assumed one; 0 where it is known
};

}  // namespace takt::alignment
