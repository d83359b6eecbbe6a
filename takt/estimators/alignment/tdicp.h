// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/motion/gyro_curve.h"
#include "takt/streams/rotation_signal.h"

namespace takt {

struct TdicpOptions {
  double window_s = 2;    ///< how long the orientation curves are trusted not to drift beyond a constant bias
  double slide_s = 0.1;   ///< how far correspondences may slide in time at first: about the error of the first guess
  int max_windows = 500;  ///< a longer recording is sampled by windows spread evenly over it
  int max_iterations = 40;
};

/// reference seconds = sensor seconds + offset_s. R_reference_sensor takes vectors sensor -> reference.
struct TdicpResult {
  double offset_s = 0;
  double sigma_s = 0;  ///< infinite where not converged
  Mat3 R_reference_sensor = Mat3::Identity();
  Vec3 bias_rad_s = Vec3::Zero();  ///< constant difference of the two sensors' rates, in the reference's frame
  int iterations = 0;
  bool converged = false;  ///< false also where too little of the data overlaps, or nothing turns
  double rms_rad = 0;      ///< angle between the registered curves
  int windows = 0;         ///< how many took part
};

/// Registers the orientation curve of a sensor with that of a gyro under an unknown time offset and an unknown rotation
/// between the two, by time-delay iterated closest points [Kelly2014]: correspondences slide along the reference curve
/// to where it comes closest, then offset and rotation are estimated again. Derivation: docs/methods/tdicp.md.
/// Sensor seconds count from `sensor_epoch`, reference seconds from the epoch of `reference`.
/// The standard deviation is measured from the scatter of the windows, so it holds whatever the noise of the sensor is.
[[nodiscard]] TdicpResult tdicp(const RotationSignal& sensor, Stamp sensor_epoch, const GyroCurve& reference,
                                double initial_offset_s, const Mat3& initial_R_reference_sensor,
                                const TdicpOptions& options = {});

}  // namespace takt
