// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "takt/streams/streams.h"

namespace takt {

/// Decodes JPEG, PNG or whatever else OpenCV knows to grey; an empty image where it is broken or no picture.
[[nodiscard]] GrayImage decode_picture(std::span<const std::byte> encoded);
[[nodiscard]] GrayImage read_picture(const std::string& path);

/// By its ending.
[[nodiscard]] bool is_picture_file(const std::string& path);

/// Pictures of a camera, one file a frame, each decoded when asked for. Missing and broken ones are skipped.
struct PictureFile {
  std::size_t index;  ///< place in the stream's stamps
  Stamp stamp;
  double exposure_s;
  std::string path;
};
[[nodiscard]] std::unique_ptr<FrameReader> read_pictures(std::shared_ptr<const std::vector<PictureFile>> files);

}  // namespace takt
