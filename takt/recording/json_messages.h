// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/recording/sensor_messages.h"

/// The same messages as JSON: ROS' own fields (`header.stamp.sec`, `nanosec` or `nsec`), or Foxglove's
/// (`timestamp.sec`, `nsec`), with binary data in base64.
namespace takt::json_messages {

[[nodiscard]] std::optional<ImuMessage> read_imu(std::span<const std::byte> message);
[[nodiscard]] std::optional<ImageHead> read_image_head(std::span<const std::byte> message);
/// `compressed` pictures are decoded by their own bytes, raw ones by their encoding.
[[nodiscard]] GrayImage read_image(std::span<const std::byte> message, bool compressed);
[[nodiscard]] std::optional<CameraInfoModel> read_camera_info(std::span<const std::byte> message);

[[nodiscard]] std::optional<Stamp> stamp(std::span<const std::byte> message);
/// The message with another stamp: the digits of its two numbers are exchanged, all else stays byte for byte.
[[nodiscard]] std::optional<std::vector<std::byte>> with_stamp(std::span<const std::byte> message, Stamp stamp);

}  // namespace takt::json_messages
