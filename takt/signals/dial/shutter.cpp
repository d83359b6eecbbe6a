// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/shutter.h"

#include <cmath>

namespace takt::dial {

std::vector<std::optional<DialMotion>> motion_of(const Film& film, const Readings& readings) {
  const std::size_t n = readings.size();
  const double furthest_s = 2.5 * film.interval_s;
  const auto slope = [&](std::size_t from, std::size_t to) -> std::optional<double> {
    const double step = film.time_s[to] - film.time_s[from];
    if (!readings[from] || !readings[to] || !(step > 0) || step > furthest_s) return std::nullopt;
    return (readings[to]->reading_rad - readings[from]->reading_rad) / step;
  };
  std::vector<std::optional<DialMotion>> out(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto before = i > 0 ? slope(i - 1, i) : std::nullopt, after = i + 1 < n ? slope(i, i + 1) : std::nullopt;
    if (before && after) {
      const double a = film.time_s[i] - film.time_s[i - 1], b = film.time_s[i + 1] - film.time_s[i];
      out[i] = {(*before * b + *after * a) / (a + b), 2 * (*after - *before) / (a + b)};
    } else if (before || after) {
      out[i] = {before ? *before : *after, 0};
    }
  }
  return out;
}

ShearLine line_through_shears(const Readings& readings, const std::vector<std::optional<DialMotion>>& motion) {
  ShearLine line;
  double furthest = 1e300;
  for (int round = 0; round < 3; ++round) {  // the second and third without what lies far off the first
    double n = 0, x = 0, y = 0, xx = 0, xy = 0, squares = 0;
    const auto each = [&](auto&& body) {
      for (std::size_t i = 0; i < readings.size(); ++i) {
        if (!readings[i] || !motion[i]) continue;
        const double away = readings[i]->shear_rad - line.constant_rad - line.line_delay_s * motion[i]->speed_rad_s;
        if (std::abs(away) <= furthest) body(motion[i]->speed_rad_s, readings[i]->shear_rad);
      }
    };
    each([&](double speed, double shear) { ++n, x += speed, y += shear, xx += speed * speed, xy += speed * shear; });
    const double spread = n * xx - x * x;
    if (n < 10 || !(spread > 0)) return line;
    line.line_delay_s = (n * xy - x * y) / spread;
    line.constant_rad = (y - line.line_delay_s * x) / n;
    each([&](double speed, double shear) {
      squares += std::pow(shear - line.constant_rad - line.line_delay_s * speed, 2);
    });
    furthest = 4 * std::sqrt(squares / n);
  }
  return line;
}

}  // namespace takt::dial
