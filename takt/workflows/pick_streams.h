// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/streams/streams.h"

namespace takt {

/// One stream of a recording, of whatever kind: exactly one pointer is set.
struct StreamRef {
  const CameraStream* camera = nullptr;
  const TrackStream* tracks = nullptr;
  const AttitudeStream* attitude = nullptr;
  const ImuStream* imu = nullptr;

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] bool is_gyro() const { return imu != nullptr; }
};

/// Sensor and reference of one recording. Left empty, the sensor is the first camera, else tracks, else attitude, else
/// the first gyro that is not the reference; the reference is the first gyro.
/// Throws takt::Error that lists what the recording has.
struct StreamPair {
  StreamRef sensor, reference;
};
[[nodiscard]] StreamPair pick_pair(const Recording& recording, const std::string& sensor, const std::string& reference);
/// Sensor from one recording, reference from another: two logs that were made apart. The reference is a gyro if there
/// is one, unless it is named.
[[nodiscard]] StreamPair pick_pair(const Recording& sensor_recording, const Recording& reference_recording,
                                   const std::string& sensor, const std::string& reference);

}  // namespace takt
