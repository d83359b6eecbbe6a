// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/target/board_layout.h"

#include <algorithm>
#include <numeric>

namespace takt {

namespace {

constexpr std::size_t most_near = 48;

struct Surroundings {
  double reach_m;
  int columns;         ///< corners in a row
  bool first_is_plus;  ///< sign of corner 0; it alternates along rows and columns
};

Surroundings around(const AprilGrid& g) {
  const double border = static_cast<double>(g.border_cells) / (6 + 2 * g.border_cells);
  return {std::min(border, g.spacing) * g.tag_m, 2 * g.columns, true};
}
Surroundings around(const Checkerboard& b) {
  return {std::min(b.row_m, b.column_m), b.columns, true};
}
Surroundings around(const Charuco& b) {
  // The markers' borders in the two white squares are as symmetric about the corner as the squares themselves.
  const double inset = 0.5 * (b.square_m - b.marker_m);
  const bool black_before_first = b.legacy || (b.rows - 1) % 2 == 0;
  return {inset + 0.1 * b.marker_m, b.columns - 1, black_before_first};
}
Surroundings around(const CircleGrid& g) {
  return {0.5 * g.spacing_m, g.columns, true};
}

}  // namespace

BoardLayout board_layout(const Target& target) {
  check(target);
  BoardLayout layout;
  layout.target = target;
  layout.markers = board_markers(target);
  layout.discs = std::holds_alternative<CircleGrid>(target);
  const Surroundings s = std::visit([](const auto& t) { return around(t); }, target);
  const std::vector<Vec3> points = board_points(target);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int row = static_cast<int>(i) / s.columns, column = static_cast<int>(i) % s.columns;
    layout.corners.push_back(
        {points[i].head<2>(), ((row + column) % 2 == 0) == s.first_is_plus ? 1.0 : -1.0, s.reach_m});
  }
  std::vector<int> all(points.size());
  std::iota(all.begin(), all.end(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto distance = [&](int k) { return (points[static_cast<std::size_t>(k)] - points[i]).squaredNorm(); };
    std::vector<int> others = all;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    std::stable_sort(others.begin(), others.end(), [&](int a, int b) { return distance(a) < distance(b); });
    others.resize(std::min(others.size(), most_near));
    if (!others.empty()) layout.pitch_m = std::max(layout.pitch_m, std::sqrt(distance(others.front())));
    layout.near.push_back(std::move(others));
  }
  return layout;
}

}  // namespace takt
