// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace takt {

/// Noise of the sensor in grey levels: variance = read² + shot·grey.
struct ImageNoise {
  double read = 1.0;
  double shot = 0.02;
};

/// Turns what the lens projects into 8-bit pixels. A row depends on nothing but the seed, the frame and the row, so any
/// number of threads makes the same picture.
class SensorNoise {
 public:
  SensorNoise(ImageNoise noise, std::uint64_t seed);
  /// `grey` holds `width` values times 1/`weight`.
  void finish_row(std::size_t frame, int y, const float* grey, float weight, int width, std::uint8_t* out) const;

 private:
  std::uint64_t seed_;
  std::array<float, 256> sigma_;  ///< by grey level
};

}  // namespace takt
