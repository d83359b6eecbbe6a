// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/streams/corners.h"
#include "takt/streams/streams.h"

/// Batch spatio-temporal calibration: a camera that sees a known board against an IMU on the same body.
/// docs/methods/batch.md has the derivation.
namespace takt {

struct BatchOptions {
  std::string model = "auto";  ///< auto (both, and they must agree), discrete or spline
  /// Interval of the spline's knots (s); nothing: chosen from the IMU's rate and tested on the residuals.
  std::optional<double> knots_s = {};
  bool drift = false;       ///< keep the drift in the answer even where the data do not ask for it
  bool line_delay = false;  ///< estimate the line delay even where the shutter is said to be global
  int threads = 0;          ///< 0: as many as there are cores; the result is the same for any number
};

template <class Visitor>
void describe(BatchOptions& o, Visitor& v) {
  v("model", o.model, "auto, discrete or spline");
  v("knots_s", o.knots_s, "interval of the spline's knots; chosen from the IMU's rate and tested when left out");
  v("drift", o.drift, "keep the drift in the answer even where the data do not ask for it");
  v("line_delay", o.line_delay, "estimate the line delay even where the shutter is said to be global");
}

/// Finds t_imu = t_camera + offset (+ drift), the camera's place on the IMU, gravity, biases and noise, without any
/// first guess. `estimates` holds both models' answers. Data that cannot answer give a refusal; streams that contradict
/// themselves (sizes, stamps out of order, no camera model) are a std::invalid_argument.
[[nodiscard]] Estimate calibrate_batch(const CornerStream& camera, const ImuStream& imu,
                                       const BatchOptions& options = {});

}  // namespace takt
