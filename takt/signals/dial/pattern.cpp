// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/pattern.h"

#include <numbers>

namespace takt::dial {

std::vector<Strip> strips(const Dial& dial, double margin_m, double most_m) {
  const std::vector<double> levels = dial_levels(dial);
  std::vector<Strip> out;
  for (std::size_t k = 0; k + 1 < levels.size(); ++k) {
    const double top = levels[k] - margin_m, height = top - (levels[k + 1] + margin_m);
    if (!(height > 0)) continue;
    const double parts = std::max(1.0, std::ceil(height / most_m));
    for (double i = 0; i < parts; ++i) out.push_back({top - height * i / parts, top - height * (i + 1) / parts});
  }
  return out;
}

Patterns printed_patterns(const Dial& dial, const std::vector<Strip>& strips, double pixel_rad) {
  constexpr double deg = std::numbers::pi / 180;
  Patterns out;
  for (const Strip& strip : strips) {
    Pattern p;
    p.step_rad = 0.5 * pixel_rad;
    p.first_rad = dial.from_deg * deg - 4 * pixel_rad;
    const auto n = static_cast<std::size_t>(((dial.to_deg - dial.from_deg) * deg + 8 * pixel_rad) / p.step_rad) + 1;
    const double height = 0.5 * (strip.top_m + strip.bottom_m);
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
