// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/streams/camera_model.h"

namespace takt {

/// The fields of sensor_msgs/CameraInfo that make a camera model.
struct CameraInfo {
  std::uint32_t width = 0, height = 0;
  std::string distortion;
  std::vector<double> d;
  std::array<double, 9> k{};
};
struct CameraInfoModel {
  CameraModel model;
  double off_px = 0;  ///< at most, in a corner: its third radial term was put into the first two
};
/// Nothing where the camera says that it is not calibrated (fx 0), or its model is one that takt does not have.
[[nodiscard]] std::optional<CameraInfoModel> model_of(const CameraInfo& info);

}  // namespace takt
