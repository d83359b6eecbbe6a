// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/recording/message_file.h"
#include "takt/recording/stored_picture.h"
#include "takt/streams/camera_model.h"
#include "takt/streams/image.h"

/// The sensor_msgs that takt writes, in ROS 1's serialization or in little-endian CDR. They throw takt::Error where a
/// stamp does not fit (ROS 1: 0 to 2³² s; ROS 2: ±2³¹ s).
namespace takt {

using MessageBytes = std::vector<std::byte>;

/// No orientation; an acceleration that is not there is marked as such, as the message's own comment asks for.
[[nodiscard]] MessageBytes imu_message(MessageEncoding encoding, Stamp stamp, const Vec3& gyro_rad_s,
                                       const Vec3* accel_m_s2);
/// mono8.
[[nodiscard]] MessageBytes image_message(MessageEncoding encoding, Stamp stamp, const GrayImage& image);
/// A picture as it was stored: an Image or a CompressedImage.
[[nodiscard]] MessageBytes image_message(MessageEncoding encoding, Stamp stamp, const StoredPicture& picture);
/// Only for cameras that `has_camera_info`.
[[nodiscard]] MessageBytes camera_info_message(MessageEncoding encoding, Stamp stamp, const CameraModel& model);
/// The message has no other lenses than pinholes with no, radtan or equidistant distortion.
[[nodiscard]] bool has_camera_info(const CameraModel& model);

/// What a recorder writes beside the messages of a type ("sensor_msgs/Imu"): its fields, and those of its parts.
[[nodiscard]] std::string message_definition(MessageEncoding encoding, std::string_view type);
/// By which ROS 1 knows a type's version.
[[nodiscard]] std::string_view ros1_md5(std::string_view type);

}  // namespace takt
