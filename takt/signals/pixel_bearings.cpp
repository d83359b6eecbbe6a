// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/pixel_bearings.h"

#include <cmath>

namespace takt {

BearingMatch match(const SeenBearing& from, const SeenBearing& to) {
  return {from.bearing, to.bearing, from.row, to.row, to.sigma_rad};
}

std::optional<SeenBearing> PixelBearings::see(const Vec2& px, double sigma_px) const {
  const auto bearing = model_.bearing(px);
  const double rad_per_px = bearing ? radians_per_px(px) : 0;
  if (!(rad_per_px > 0)) return std::nullopt;
  return SeenBearing{bearing->cast<float>(), row(px), static_cast<float>(sigma_px * rad_per_px)};
}

std::optional<Vec2> PixelBearings::turned(const Vec2& from_px, const Mat3& R_from_to) const {
  const auto b = model_.bearing(from_px);
  return b ? model_.project(R_from_to.transpose() * *b) : std::nullopt;
}

double PixelBearings::radians_per_px(const Vec2& px) const {
  constexpr double half_step = 0.5;
  const auto left = model_.bearing(px - Vec2(half_step, 0)), right = model_.bearing(px + Vec2(half_step, 0));
  const auto above = model_.bearing(px - Vec2(0, half_step)), below = model_.bearing(px + Vec2(0, half_step));
  if (!left || !right || !above || !below) return 0;
  return std::sqrt((*right - *left).cross(*below - *above).norm());  // √ of the solid angle of one pixel
}

}  // namespace takt
