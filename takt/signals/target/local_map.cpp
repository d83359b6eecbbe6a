// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/local_map.h"

#include <algorithm>

namespace takt {

namespace {

constexpr std::size_t fewest = 5;
constexpr std::size_t enough = 12;

}  // namespace

std::optional<PlaneMap> local_map(const std::vector<PlacedPixel>& pairs, const Vec2& place, std::size_t most,
                                  double furthest_m) {
  std::vector<PlacedPixel> near;
  for (const PlacedPixel& p : pairs)
    if ((p.place - place).norm() <= furthest_m) near.push_back(p);
  if (near.size() < fewest) return std::nullopt;
  std::stable_sort(near.begin(), near.end(), [&](const PlacedPixel& a, const PlacedPixel& b) {
    return (a.place - place).squaredNorm() < (b.place - place).squaredNorm();
  });
  near.resize(std::min(near.size(), most));
  return PlaneMap::fit(near);
}

std::optional<PlaneMap> map_around(const BoardLayout& layout, const std::vector<std::optional<Vec2>>& pixels,
                                   int corner, bool without_itself) {
  std::array<PlacedPixel, enough + 1> near;
  std::size_t n = 0;
  const auto self = static_cast<std::size_t>(corner);
  if (!without_itself && pixels[self]) near[n++] = {layout.corners[self].place, *pixels[self]};
  const double furthest = 4.5 * layout.pitch_m;
  for (const int k : layout.near[self]) {
    const auto i = static_cast<std::size_t>(k);
    if (n == enough || (layout.corners[i].place - layout.corners[self].place).norm() > furthest) break;
    if (pixels[i]) near[n++] = {layout.corners[i].place, *pixels[i]};
  }
  if (n < fewest) return std::nullopt;
  return PlaneMap::fit(std::span(near.data(), n));
}

}  // namespace takt
