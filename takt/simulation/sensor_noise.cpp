// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/sensor_noise.h"

#include <algorithm>
#include <cmath>

#include "takt/simulation/random.h"

namespace takt {

namespace {

/// Standard normal values at the middles of 4096 equally likely intervals: noise by table is as fast as memory.
const std::array<float, 4096>& normal_quantiles() {
  static const std::array<float, 4096> table = [] {
    std::array<float, 4096> out{};
    double x = -5;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double p = (static_cast<double>(i) + 0.5) / static_cast<double>(out.size());
      for (int round = 0; round < 50; ++round) {  // Newton from the quantile before
        const double error = 0.5 * std::erfc(-x / std::numbers::sqrt2) - p;
        const double step = error / (std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi));
        x -= std::clamp(step, -0.5, 0.5);
        if (std::abs(step) < 1e-12) break;
      }
      out[i] = static_cast<float>(x);
    }
    return out;
  }();
  return table;
}

}  // namespace

SensorNoise::SensorNoise(ImageNoise noise, std::uint64_t seed) : seed_(Random(seed, "image noise").bits()) {
  for (std::size_t grey = 0; grey < sigma_.size(); ++grey)
    sigma_[grey] = static_cast<float>(std::sqrt(noise.read * noise.read + noise.shot * static_cast<double>(grey)));
}

void SensorNoise::finish_row(std::size_t frame, int y, const float* sum, float weight, int width,
                             std::uint8_t* out) const {
  const auto& normal = normal_quantiles();
  const std::uint64_t row_seed = mix64(seed_ ^ mix64(frame * 0x10001 + static_cast<std::uint64_t>(y) * 0x9e3779b1));
  std::uint64_t bits = 0;
  for (int x = 0; x < width; ++x) {
    if (x % 5 == 0) bits = mix64(row_seed + static_cast<std::uint64_t>(x));
    const float grey = std::clamp(weight * sum[x], 0.0f, 255.0f);
    const float noisy = grey + sigma_[static_cast<std::size_t>(grey)] * normal[bits & 4095];
    bits >>= 12;
    out[x] = static_cast<std::uint8_t>(std::clamp(noisy + 0.5f, 0.0f, 255.0f));
  }
}

}  // namespace takt
