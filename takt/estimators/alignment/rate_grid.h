// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/estimators/alignment/problem.h"

namespace takt::alignment {

/// Mean angular rates over the cells of a uniform grid; a cell that is not wholly covered by measurements is invalid.
struct RateGrid {
  double begin_s = 0;
  double cell_s = 0;
  std::vector<Vec3> rate;     ///< rad/s, own frame; zero where invalid
  std::vector<double> valid;  ///< 1 or 0

  [[nodiscard]] double centre_s(std::size_t i) const { return begin_s + (static_cast<double>(i) + 0.5) * cell_s; }
};

/// Each of the sensor's steps as one value, in the cell where its middle lies; all other cells are invalid. With cells
/// finer than the steps nothing of a fast motion is blurred.
[[nodiscard]] RateGrid step_grid(const Problem& problem, double cell_s);
/// Increments spread evenly over their lengths, on cells from `begin_s` to `end_s`. Two signals over the same steps are
/// smoothed alike, so what the spreading does to a phase cancels between them.
[[nodiscard]] RateGrid spread_grid(const std::vector<Step>& steps, double begin_s, double end_s, double cell_s);
/// The gyro averaged over `window_s` around each cell's centre, to match the length of the sensor's steps.
[[nodiscard]] RateGrid reference_grid(const Problem& problem, double cell_s, double window_s);

/// Sensor and reference on grids of the same cells, for the search.
struct RateGrids {
  RateGrid sensor, reference;
  double cell_s;
  /// An offset of the reference against the sensor, for a lag in cells.
  [[nodiscard]] double offset_of(double lag) const { return reference.begin_s - sensor.begin_s + lag * cell_s; }
  [[nodiscard]] double lag_of(double offset_s) const {
    return (offset_s - reference.begin_s + sensor.begin_s) / cell_s;
  }
};
[[nodiscard]] RateGrids rate_grids(const Problem& problem);

}  // namespace takt::alignment
