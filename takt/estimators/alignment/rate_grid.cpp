// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/rate_grid.h"

#include <algorithm>
#include <cmath>

namespace takt::alignment {

RateGrid step_grid(const Problem& problem, double cell_s) {
  RateGrid grid;
  grid.cell_s = cell_s;
  // The first step's middle is the middle of a cell, and with even steps so are all others.
  grid.begin_s = 0.5 * (problem.steps.front().t0 + problem.steps.front().t1 - cell_s);
  const auto cells = static_cast<std::size_t>(std::ceil((problem.steps.back().t1 - grid.begin_s) / cell_s));
  grid.rate.assign(cells, Vec3::Zero());
  grid.valid.assign(cells, 0.0);
  double off_centre = 0;
  for (const Step& s : problem.steps) {
    const double middle = 0.5 * (s.t0 + s.t1) - grid.begin_s;
    const std::size_t i = std::min(cells - 1, static_cast<std::size_t>(middle / cell_s));
    grid.rate[i] += s.apparent / (s.t1 - s.t0);
    grid.valid[i] += 1;
    off_centre += (middle - (static_cast<double>(i) + 0.5) * cell_s) / static_cast<double>(problem.steps.size());
  }
  // The first step's middle is a chance among uneven steps: the cells stand where the steps are in the mean.
  grid.begin_s += off_centre;
  for (std::size_t i = 0; i < cells; ++i)
    if (grid.valid[i] > 0) grid.rate[i] /= grid.valid[i], grid.valid[i] = 1;
  return grid;
}

RateGrid spread_grid(const std::vector<Step>& steps, double begin_s, double end_s, double cell_s) {
  RateGrid grid;
  grid.cell_s = cell_s;
  grid.begin_s = begin_s;
  const auto cells = static_cast<std::size_t>(std::floor((end_s - begin_s) / cell_s));
  grid.rate.assign(cells, Vec3::Zero());
  std::vector<double> covered(cells, 0.0);
  for (const Step& s : steps) {
    const Vec3 rate = s.apparent / (s.t1 - s.t0);
    auto i = static_cast<std::size_t>(std::max(0.0, std::floor((s.t0 - grid.begin_s) / cell_s)));
    for (; i < cells; ++i) {
      const double lo = grid.begin_s + static_cast<double>(i) * cell_s;
      const double overlap = std::min(s.t1, lo + cell_s) - std::max(s.t0, lo);
      if (lo >= s.t1) break;
      if (overlap <= 0) continue;
      grid.rate[i] += overlap / cell_s * rate;
      covered[i] += overlap / cell_s;
    }
  }
  grid.valid.assign(cells, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    if (covered[i] > 0.999)
      grid.valid[i] = 1;
    else
      grid.rate[i].setZero();
  }
  return grid;
}

RateGrid reference_grid(const Problem& problem, double cell_s, double window_s) {
  const GyroCurve& gyro = problem.reference;
  const auto t = gyro.times_s();
  const auto w = gyro.rates();
  // Running integral by trapezia: a mean over a window is then two look-ups.
  std::vector<Vec3> integral(t.size(), Vec3::Zero());
  for (std::size_t i = 1; i < t.size(); ++i)
    integral[i] = integral[i - 1] + 0.5 * (t[i] - t[i - 1]) * (w[i] + w[i - 1]);

  RateGrid grid;
  grid.cell_s = cell_s;
  grid.begin_s = gyro.begin_s();
  const auto cells = static_cast<std::size_t>(std::floor((gyro.end_s() - grid.begin_s) / cell_s));
  grid.rate.assign(cells, Vec3::Zero());
  grid.valid.assign(cells, 0.0);
  const double half = 0.5 * std::max(window_s, cell_s);
  std::size_t lo = 0, hi = 0;
  const auto integral_at = [&](double x, std::size_t& hint) {
    while (hint + 2 < t.size() && t[hint + 1] < x) ++hint;
    const double h = t[hint + 1] - t[hint], b = (x - t[hint]) / h;
    return Vec3(integral[hint] + b * h * ((1 - 0.5 * b) * w[hint] + 0.5 * b * w[hint + 1]));
  };
  for (std::size_t i = 0; i < cells; ++i) {
    const double centre = grid.centre_s(i), a = centre - half, b = centre + half;
    if (!gyro.covers(a, b)) continue;
    const Vec3 before = integral_at(a, lo), after = integral_at(b, hi);
    grid.rate[i] = (after - before) / (b - a);
    grid.valid[i] = 1;
  }
  return grid;
}

RateGrids rate_grids(const Problem& p) {
  constexpr double most_cells = 1u << 17;
  const double length = std::max(p.steps.back().t1 - p.steps.front().t0, p.reference.end_s() - p.reference.begin_s());
  // A quarter of a sensor step: the fastest motion that the sensor can show still has its peak within reach of a cell.
  const double cell = std::max(0.25 * p.step_s, length / most_cells);
  return {step_grid(p, cell), reference_grid(p, cell, p.step_s), cell};
}

}  // namespace takt::alignment
