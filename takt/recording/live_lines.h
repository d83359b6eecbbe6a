// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "takt/streams/streams.h"

/// Samples as they come through a pipe, one JSON object a line (docs/formats/stream.md).
namespace takt {

struct LiveImuSample {
  std::string imu;
  Stamp stamp;
  Vec3 gyro_rad_s = Vec3::Zero(), accel_m_s2 = Vec3::Zero();
};
struct LiveFrame {
  std::string camera;
  Stamp stamp;
  double exposure_s = 0;  ///< 0 where it is not said
  std::vector<TrackedFeature> features;
};
using LiveSample = std::variant<LiveImuSample, LiveFrame>;

/// What a line says; where it says nothing that is understood, nothing, and `why` in words.
[[nodiscard]] std::optional<LiveSample> read_live_line(std::string_view line, std::string& why);

}  // namespace takt
