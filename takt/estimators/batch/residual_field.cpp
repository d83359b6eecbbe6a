// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/residual_field.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace takt::batch {

namespace {

constexpr int columns = 12, rows = 8;
constexpr int fewest_in_a_cell = 6;

struct Cell {
  double n = 0;
  Vec2 sum = Vec2::Zero();
};

}  // namespace

bool ResidualField::is_clear() const {
  return dof >= 8 && chi2_per_dof > 1 + 5 * std::sqrt(2.0 / dof) + 10.0 / dof;
}

ResidualField residual_field(std::span<const Vec2> at_px, std::span<const Vec2> off_px, int width, int height,
                             double noise_px) {
  std::vector<Cell> cells(static_cast<std::size_t>(columns * rows));
  for (std::size_t i = 0; i < at_px.size(); ++i) {
    const int x = std::clamp(static_cast<int>(at_px[i].x() * columns / width), 0, columns - 1),
              y = std::clamp(static_cast<int>(at_px[i].y() * rows / height), 0, rows - 1);
    Cell& cell = cells[static_cast<std::size_t>(y * columns + x)];
    cell.n += 1;
    cell.sum += off_px[i];
  }
  ResidualField out;
  double chi2 = 0, squares = 0, corners = 0;
  for (const Cell& c : cells) {
    if (c.n < fewest_in_a_cell) continue;
    const double mean2 = (c.sum / c.n).squaredNorm();
    chi2 += c.n * mean2 / (noise_px * noise_px);
    squares += c.n * (0.5 * mean2 - noise_px * noise_px / c.n);
    corners += c.n;
    out.dof += 2;
  }
  if (out.dof == 0) return out;
  out.chi2_per_dof = chi2 / out.dof;
  out.systematic_px = std::sqrt(std::max(0.0, squares / corners));
  return out;
}

}  // namespace takt::batch
