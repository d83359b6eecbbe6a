// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/streams/corners.h"
#include "takt/streams/streams.h"

/// Batch spatio-temporal calibration: cameras that see a known board against IMUs on the same body.
/// docs/methods/batch.md has the derivation.
namespace takt {

struct BatchOptions {
  std::string model = "auto";  ///< auto (both, and they must agree), discrete or spline
  /// Interval of the spline's knots (s); nothing: chosen from the IMU's rate and tested on the residuals.
  std::optional<double> knots_s = {};
  /// calibrated: an IMU is what its data sheet says; scale-misalignment: scales and axes of gyro and accelerometer are
  /// sought too, as Kalibr has it; auto: where the residuals ask for it.
  std::string imu_model = "auto";
  bool drift = false;       ///< keep the drift in the answer even where the data do not ask for it
  bool line_delay = false;  ///< estimate the line delay even where the shutter is said to be global
  int threads = 0;          ///< 0: as many as there are cores; the result is the same for any number
};

template <class Visitor>
void describe(BatchOptions& o, Visitor& v) {
  v("model", o.model, "auto, discrete or spline");
  v("knots_s", o.knots_s, "interval of the spline's knots; chosen from the IMU's rate and tested when left out");
  v("imu_model", o.imu_model, "auto, calibrated or scale-misalignment");
  v("drift", o.drift, "keep the drift in the answer even where the data do not ask for it");
  v("line_delay", o.line_delay, "estimate the line delay even where the shutter is said to be global");
}

/// Cameras and IMUs that are fixed to each other, all calibrated in one: one motion that every corner and every reading
/// is compared with. Each camera has its own offset, drift, line delay and place; each further IMU its own offset,
/// drift and place against the first. Finds t_imu0 = t_sensor + offset (+ drift), gravity, biases and noise without any
/// first guess.
/// Returns one estimate a camera against imus[0], in their order, then one a further IMU (as the sensor) against
/// imus[0]. A sensor that cannot be used is refused, and the others go on without it. A camera's `estimates` hold the
/// answers of both models: the discrete one sees this camera and the first IMU alone.
/// Streams that contradict themselves (sizes, stamps out of order, no camera model) and an empty list are a
/// std::invalid_argument.
[[nodiscard]] std::vector<Estimate> calibrate_rig(std::span<const CornerStream> cameras,
                                                  std::span<const ImuStream> imus, const BatchOptions& options = {});

/// The rig of one camera and one IMU.
[[nodiscard]] Estimate calibrate_batch(const CornerStream& camera, const ImuStream& imu,
                                       const BatchOptions& options = {});

}  // namespace takt
