// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/disc.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace takt {

std::optional<Disc> refine_disc(const GrayImage& image, const Vec2& start, double reach_px) {
  const double reach = std::min(reach_px, 60.0);
  if (!(reach >= 3)) return std::nullopt;
  Vec2 c = start;
  double area = 0;
  for (int round = 0; round < 20; ++round) {
    const int x0 = static_cast<int>(std::ceil(c.x() - reach)), x1 = static_cast<int>(std::floor(c.x() + reach));
    const int y0 = static_cast<int>(std::ceil(c.y() - reach)), y1 = static_cast<int>(std::floor(c.y() + reach));
    if (x0 < 0 || y0 < 0 || x1 >= image.width || y1 >= image.height) return std::nullopt;
    std::vector<std::uint8_t> greys;
    for (int y = y0; y <= y1; ++y) greys.insert(greys.end(), image.row(y) + x0, image.row(y) + x1 + 1);
    std::sort(greys.begin(), greys.end());
    const double dark = greys[greys.size() / 20], light = greys[greys.size() * 19 / 20];
    if (light - dark < 20) return std::nullopt;
    // What is lighter than a fifth of the way is paper and its noise, which would pull towards the window's middle. The
    // weight begins there from zero: a jump would make pixels at the edge count or not by their noise.
    constexpr double paper = 0.2;
    double sum = 0;
    area = 0;
    Vec2 moment = Vec2::Zero();
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const double ink = std::clamp((light - image.row(y)[x]) / (light - dark), 0.0, 1.0);
        if ((Vec2(x, y) - c).norm() > reach) continue;
        if (ink > paper) area += ink;
        const double weight = std::max(0.0, ink - paper);
        sum += weight;
        moment += weight * Vec2(x, y);
      }
    if (!(sum > 4)) return std::nullopt;
    const Vec2 next = moment / sum;
    const double moved = (next - c).norm();
    c = next;
    if ((c - start).norm() > reach) return std::nullopt;
    if (moved < 0.002) break;
  }
  return Disc{c, area};
}

}  // namespace takt
