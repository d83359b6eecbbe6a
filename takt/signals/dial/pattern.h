// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "takt/streams/dial.h"

namespace takt::dial {

/// Grey along the dial at even steps of the angle.
struct Pattern {
  double first_rad = 0, step_rad = 1;
  std::vector<float> grey;
  /// Mean over the strip of grey times the rows from its middle: where a strip does not look the same at all its
  /// heights. As long as `grey`, or empty where it does.
  std::vector<float> tilt;

  [[nodiscard]] double last_rad() const { return first_rad + step_rad * static_cast<double>(grey.size() - 1); }

  struct Sample {
    float grey, slope;  ///< slope per radian
  };
  [[nodiscard]] Sample at(double angle_rad) const { return sample(grey, angle_rad); }
  /// By how much a shear of one radian a row changes the grey, beyond what the strip's mean row tells.
  [[nodiscard]] float grey_by_shear(double angle_rad) const { return tilt.empty() ? 0 : sample(tilt, angle_rad).slope; }

 private:
  /// Catmull–Rom; beyond the ends the end's grey without a slope.
  [[nodiscard]] Sample sample(const std::vector<float>& v, double angle_rad) const {
    const double x = (angle_rad - first_rad) / step_rad;
    if (!(x >= 1)) return {v.front(), 0};
    if (x >= static_cast<double>(v.size()) - 2) return {v.back(), 0};
    const auto i = static_cast<std::size_t>(x);
    const auto f = static_cast<float>(x - static_cast<double>(i));
    const float a = v[i - 1], b = v[i], c = v[i + 1], d = v[i + 2];
    const float k1 = 0.5f * (c - a), k2 = a - 2.5f * b + 2 * c - 0.5f * d, k3 = 0.5f * (d - a) + 1.5f * (b - c);
    return {b + f * (k1 + f * (k2 + f * k3)), (k1 + f * (2 * k2 + 3 * f * k3)) / static_cast<float>(step_rad)};
  }
};

/// A stretch of heights in which the dial looks the same.
struct Strip {
  double top_m, bottom_m;
};
/// From the top down. `margin_m` is left out on both sides of where the print changes, and no strip is higher than
/// `most_m`: the rows of a rolling shutter are to be told apart.
[[nodiscard]] std::vector<Strip> strips(const Dial& dial, double margin_m, double most_m);

/// One pattern for each strip.
using Patterns = std::vector<Pattern>;

/// The dial as printed, seen through pixels of a width: 1 paper, 0 ink.
[[nodiscard]] Patterns printed_patterns(const Dial& dial, const std::vector<Strip>& strips, double pixel_rad);

}  // namespace takt::dial
