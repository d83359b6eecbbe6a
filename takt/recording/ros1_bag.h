// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "takt/recording/files.h"
#include "takt/recording/format.h"

/// ROS 1 bags: sensor_msgs/Imu, Image, CompressedImage and CameraInfo. A stream is named after its topic; stamps are
/// header.stamp, the sensor's; the recorder's own time is kept out. Pictures are decoded from their chunk when asked
/// for.
namespace takt {

[[nodiscard]] bool looks_like_ros1_bag(const std::string& path);
[[nodiscard]] Recording read_ros1_bag(const std::string& path, const OpenOptions& options);
[[nodiscard]] Recording read_ros1_bag(std::shared_ptr<const ByteSource> bytes, const std::string& path);

/// A streamed copy, one chunk in memory at a time. Chunks in which nothing changes, and all other records, are copied
/// byte for byte; places in the index are corrected.
[[nodiscard]] Restamped restamp_ros1_bag(const std::string& in, const std::string& out, const Restamping& order,
                                         const OpenOptions& options);

}  // namespace takt
