// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/streams/streams.h"

namespace takt {

struct PendulumOptions {
  /// `extrema` and `damped` use swings from the first to the second amplitude (degrees, descending), [Fu2021] §3.1, or
  /// all where there are fewer than four between them. `spline` uses every swing from its start to a tenth of the
  /// largest, for each one knows something; from the first amplitude on where the delay comes out surer without those
  /// before it (a wobble after the release).
  double window_from_deg = 15;
  double window_to_deg = 9;
  bool window_is_required = false;   ///< the window holds for all three: refuse instead of using other swings
  bool estimate_line_delay = false;  ///< needs readings from several rows
  /// The IMU is triggered and its stamps are the trigger's: the result is also told as the trigger's lead.
  bool stamps_are_triggers = false;
};

/// The output delay of an IMU on a pendulum's bob [Fu2021]: t_imu = t_cam + offset, t_cam the middle of the exposure
/// of the dial's reference row. Three estimators run side by side (docs/methods/pendulum.md):
///   extrema  as published, eq. 10 and 11; neglects the phase that damping adds
///   damped   the same swing by swing with e^{−δt} and the exact phase
///   spline   one joint maximum-likelihood fit of the whole motion; this is the result
/// The offset is sought within a quarter of the period: a shift by half a period looks the same as a gyro mounted the
/// other way round. A larger one is found where the period changes enough with the dying amplitude to count the half
/// swings, and is then called weak.
/// Refuses, with reasons, a pendulum at rest, too few swings, wrong units, streams that do not overlap.
[[nodiscard]] Estimate calibrate_pendulum(const AngleStream& dial, const ImuStream& imu,
                                          const PendulumOptions& options = {});

}  // namespace takt
