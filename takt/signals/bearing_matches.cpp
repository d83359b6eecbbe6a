// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/bearing_matches.h"

#include <cmath>

namespace takt {

std::optional<BearingMatch> BearingMatches::match(const Vec2& from_px, const Vec2& to_px, double sigma_px) const {
  const auto from = model_.bearing(from_px), to = model_.bearing(to_px);
  if (!from || !to) return std::nullopt;
  const double rad_per_px = radians_per_px(to_px);
  if (!(rad_per_px > 0)) return std::nullopt;
  BearingMatch m;
  m.from = from->cast<float>();
  m.to = to->cast<float>();
  m.row_from = row(from_px);
  m.row_to = row(to_px);
  m.sigma_rad = static_cast<float>(sigma_px * rad_per_px);
  return m;
}

std::optional<Vec2> BearingMatches::turned(const Vec2& from_px, const Mat3& R_from_to) const {
  const auto b = model_.bearing(from_px);
  return b ? model_.project(R_from_to.transpose() * *b) : std::nullopt;
}

double BearingMatches::radians_per_px(const Vec2& px) const {
  constexpr double half_step = 0.5;
  const auto left = model_.bearing(px - Vec2(half_step, 0)), right = model_.bearing(px + Vec2(half_step, 0));
  const auto above = model_.bearing(px - Vec2(0, half_step)), below = model_.bearing(px + Vec2(0, half_step));
  if (!left || !right || !above || !below) return 0;
  return std::sqrt((*right - *left).cross(*below - *above).norm());  // √ of the solid angle of one pixel
}

}  // namespace takt
