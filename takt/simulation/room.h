// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "takt/motion/rotation.h"

namespace takt {

/// A grey picture on a wall; texel (0, 0) has its centre in the wall's corner with the smallest coordinates.
struct Texture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> texels;  ///< row-major

  /// Bilinear, clamped at the edges.
  [[nodiscard]] float at(float x, float y) const {
    x = x < 0 ? 0 : x > static_cast<float>(width) - 1.001f ? static_cast<float>(width) - 1.001f : x;
    y = y < 0 ? 0 : y > static_cast<float>(height) - 1.001f ? static_cast<float>(height) - 1.001f : y;
    const int ix = static_cast<int>(x), iy = static_cast<int>(y);
    const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
    const std::uint8_t* p = texels.data() + static_cast<std::ptrdiff_t>(iy) * width + ix;
    const float top = static_cast<float>(p[0]) + fx * static_cast<float>(p[1] - p[0]);
    const float bottom = static_cast<float>(p[width]) + fx * static_cast<float>(p[width + 1] - p[width]);
    return top + fy * (bottom - top);
  }
};

/// The inside of a box around the world's origin, with a picture on each of its six faces. Seen from a moving camera
/// its corners and walls at different distances give parallax.
struct Room {
  Vec3 half_extent_m;
  double texel_m = 0.005;
  /// Face 2·axis lies at −half_extent of that axis, face 2·axis + 1 at +half_extent. Texture x and y run along the
  /// next axis and the one after it (x → y, z; y → z, x; z → x, y).
  std::array<Texture, 6> faces;

  [[nodiscard]] static constexpr int u_axis(int axis) { return (axis + 1) % 3; }
  [[nodiscard]] static constexpr int v_axis(int axis) { return (axis + 2) % 3; }
};

/// Walls of overlapping shards of many sizes and shades ("dead leaves", whose statistics are those of natural
/// scenes: corners at every scale), smoothed so that no detail is finer than a few texels.
[[nodiscard]] Room make_room(const Vec3& half_extent_m, double texel_m, std::uint64_t seed);

/// Points on the walls, evenly over their area (world frame, m).
[[nodiscard]] std::vector<Vec3> landmarks_on_walls(const Vec3& half_extent_m, int count, std::uint64_t seed);

}  // namespace takt
