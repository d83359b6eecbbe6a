// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "takt/signals/dial/pattern.h"
#include "takt/streams/dial.h"
#include "takt/streams/image.h"

namespace takt::dial {

/// What the pixels of one slot have in common: they see nearly the same angle, in the same strip of heights.
struct Slot {
  double angle_rad;  ///< mean over its pixels, against the radius through the camera
  double height_m;   ///< mean
  double row;        ///< mean
  int pixels;
  int strip;  ///< which Pattern
};

/// A frame reduced to the means of its slots.
struct Profile {
  std::vector<float> grey;    ///< one a slot
  std::vector<float> tilt;    ///< mean of grey·(row − the slot's), one a slot; empty where rows do not matter
  float saturated_share = 0;  ///< of the pixels on the dial
};

/// Picks the dial out of a frame: each pixel on the strip belongs to one slot, and no pixel is interpolated. Across
/// the strip hundreds of pixels are averaged; along it a slot is one pixel wide.
class Rectifier {
 public:
  /// `rows`: profiles tell where in a slot its grey is.
  Rectifier(const std::vector<Strip>& strips, const DialView& view, bool rows);

  [[nodiscard]] const std::vector<Slot>& slots() const { return slots_; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool fits(const GrayImage& image) const { return image.width == width_ && image.height == height_; }
  /// Throws std::invalid_argument for an image that does not fit.
  [[nodiscard]] Profile operator()(const GrayImage& image) const;

 private:
  struct Pixel {
    std::int32_t x, y, slot;
  };
  int width_, height_;
  bool rows_;
  std::vector<Pixel> pixels_;  ///< row by row
  std::vector<Slot> slots_;
};

}  // namespace takt::dial
