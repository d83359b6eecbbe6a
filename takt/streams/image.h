// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>

namespace takt {

/// A grey 8-bit image that shares its pixels: copying the handle copies no pixel.
/// A decoder hands out its own luma plane; `owner` keeps it alive.
struct GrayImage {
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;             ///< bytes from row to row
  const std::uint8_t* pixels = nullptr;  ///< row-major, `height` rows
  std::shared_ptr<const void> owner;

  [[nodiscard]] bool empty() const { return pixels == nullptr; }
  [[nodiscard]] const std::uint8_t* row(int y) const { return pixels + y * stride; }
};

}  // namespace takt
