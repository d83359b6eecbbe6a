// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/recording/camera_info.h"
#include "takt/recording/message_file.h"
#include "takt/recording/stored_picture.h"
#include "takt/streams/image.h"

/// The sensor_msgs that takt reads, whatever their encoding.
namespace takt {

enum class SensorMessage { none, imu, image, compressed_image, camera_info };
/// What a channel carries, by its type's name: ROS', or Foxglove's in JSON.
[[nodiscard]] SensorMessage sensor_message(const Channel& channel);

/// "/cam0/image_raw/compressed" and "/cam0/camera_info" share "/cam0".
[[nodiscard]] std::string name_space(std::string topic);

struct ImuMessage {
  Stamp stamp;
  Vec3 gyro_rad_s, accel_m_s2;
  bool has_accel = true;  ///< false where the message itself says "not measured"
};
[[nodiscard]] std::optional<ImuMessage> read_imu(MessageEncoding encoding, std::span<const std::byte> message);

/// A picture's stamp and kind, from the first bytes of its message.
struct ImageHead {
  Stamp stamp;
  std::uint32_t rows = 0;  ///< 0 where only the picture itself knows
  std::string encoding;    ///< likewise empty
};
/// Enough bytes of an Image or CompressedImage for its head; of JSON it takes all.
constexpr std::uint64_t image_head_bytes = 2048;
[[nodiscard]] std::optional<ImageHead> read_image_head(const Channel& channel, std::span<const std::byte> head);

/// The picture as it stands in the message; nothing where it is broken, or in JSON.
[[nodiscard]] std::optional<StoredPicture> read_stored_picture(const Channel& channel,
                                                               std::span<const std::byte> message);
/// The picture in grey; `owner` keeps the message's bytes alive. Empty where it is broken or of no known kind.
[[nodiscard]] GrayImage read_image(const Channel& channel, std::span<const std::byte> message,
                                   std::shared_ptr<const void> owner);

/// The intrinsics of a CameraInfo; nothing where it says that there are none, or has a model that takt has not.
[[nodiscard]] std::optional<CameraInfoModel> read_camera_info(MessageEncoding encoding,
                                                              std::span<const std::byte> message);

}  // namespace takt
