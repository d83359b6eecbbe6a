// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "takt/recording/raw_picture.h"
#include "takt/streams/streams.h"

/// Pictures as they lie in a recording, with the colours that estimators have no use for: for those who pass them on.
namespace takt {

/// A JPEG or PNG file's bytes. `format` as sensor_msgs/CompressedImage has it.
struct EncodedPicture {
  std::string_view format;
  std::span<const std::byte> bytes;
};
using StoredPicture = std::variant<EncodedPicture, RawPicture>;

/// What a FrameReader may be besides.
class KeepsStored {
 public:
  virtual ~KeepsStored() = default;
  /// The frame that next() gave last, valid until it is called again. Nothing where it is stored in another way.
  [[nodiscard]] virtual std::optional<StoredPicture> stored() const = 0;
};

/// Of a reader's last frame; nothing where the reader does not keep it.
[[nodiscard]] inline std::optional<StoredPicture> stored_picture(const FrameReader& reader) {
  const auto* const keeps = dynamic_cast<const KeepsStored*>(&reader);
  return keeps ? keeps->stored() : std::nullopt;
}

}  // namespace takt
