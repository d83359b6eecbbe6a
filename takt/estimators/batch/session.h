// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/estimators/batch/board_pose.h"
#include "takt/motion/imu_curve.h"
#include "takt/motion/preintegration.h"
#include "takt/streams/corners.h"
#include "takt/streams/streams.h"

namespace takt::batch {

/// A camera's frames in seconds after its first stamp.
struct CameraSession {
  const CornerStream* stream = nullptr;
  Stamp epoch{};
  std::vector<double> time_s;  ///< of every frame: the middle of the exposure of the reference row
  BoardViews poses;
  double reference_row = 0;  ///< what rows are counted from: 0, or the middle one

  [[nodiscard]] const CameraModel& model() const { return *stream->model; }
  [[nodiscard]] double line_delay_s() const { return stream->timing.line_delay_s(); }
  [[nodiscard]] double row(const CornerObservation& c) const { return c.pixel.y() - reference_row; }
};

/// An IMU in seconds after its first stamp, in rad/s and m/s².
struct ImuSession {
  const ImuStream* stream = nullptr;
  Stamp epoch{};
  ImuCurve curve;
  double rate_hz = 0;
  ImuDensity high_pass{};    ///< white noise as sixth differences show it: a first guess, nothing more
  bool was_in_g = false;     ///< the accelerometer was found to count in g and converted
  double typical_accel = 0;  ///< median length of the specific force, m/s²

  /// Moved by hand or at rest, an accelerometer reads about one gravity in the middle.
  [[nodiscard]] bool counts_metres() const { return typical_accel > 4 && typical_accel < 25; }
};

/// Throws std::invalid_argument for streams that contradict themselves (sizes, no model, stamps out of order).
[[nodiscard]] CameraSession open_camera(const CornerStream& stream, int threads);
[[nodiscard]] ImuSession open_imu(const ImuStream& stream);

}  // namespace takt::batch
