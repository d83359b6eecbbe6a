// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/pattern.h"

#include <numbers>

namespace takt::dial {

Patterns printed_patterns(const Dial& dial, double pixel_rad) {
  constexpr double deg = std::numbers::pi / 180;
  const std::vector<double> levels = dial_levels(dial);
  Patterns out;
  for (std::size_t k = 0; k + 1 < levels.size(); ++k) {
    Pattern p;
    p.step_rad = 0.5 * pixel_rad;
    p.first_rad = dial.from_deg * deg - 4 * pixel_rad;
    const auto n = static_cast<std::size_t>(((dial.to_deg - dial.from_deg) * deg + 8 * pixel_rad) / p.step_rad) + 1;
    const double height = 0.5 * (levels[k] + levels[k + 1]);
    std::vector<double> sharp;
    for (std::size_t i = 0; i < n; ++i) {
      const double at = p.first_rad + static_cast<double>(i) * p.step_rad;
      sharp.push_back(1 - ink_share(dial, at - 0.5 * pixel_rad, at + 0.5 * pixel_rad, height));
    }
    // The lens: a bell of about half a pixel.
    for (std::size_t i = 0; i < n; ++i) {
      const double left = sharp[i > 0 ? i - 1 : 0], right = sharp[std::min(i + 1, n - 1)];
      p.grey.push_back(static_cast<float>(0.25 * left + 0.5 * sharp[i] + 0.25 * right));
    }
    out.push_back(std::move(p));
  }
  return out;
}

}  // namespace takt::dial
