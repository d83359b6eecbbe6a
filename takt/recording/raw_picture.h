// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "takt/streams/image.h"

namespace takt {

/// An uncompressed picture as ROS names its encodings (sensor_msgs/image_encodings.h).
struct RawPicture {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t stride = 0;  ///< bytes from row to row
  std::string_view encoding;
  std::span<const std::byte> pixels;
  bool big_endian = false;  ///< matters where a value has two bytes
};

[[nodiscard]] bool is_known_encoding(std::string_view encoding);

/// To grey: mono8 as it stands, sharing `owner`; colours by BT.601; Bayer mosaics by the 3×3 binomial filter, which
/// weighs R, G, B by 1/4, 1/2, 1/4 at every pixel; YUV by its luma. Of two-byte values the upper eight of the 8, 10,
/// 12, 14 or 16 bits that the picture's largest value needs are taken. Empty where the sizes disagree or the encoding is
/// unknown.
[[nodiscard]] GrayImage to_gray(const RawPicture& picture, std::shared_ptr<const void> owner);

}  // namespace takt
