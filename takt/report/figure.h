// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/evidence.h"
#include "takt/report/axis.h"

namespace takt::report {

/// One shape of one series, in the data's units. What belongs to the same series shares its name and colour.
struct Layer {
  enum class Shape {
    line,      ///< through x, y; NaN breaks it
    dots,      ///< at x, y
    segments,  ///< upright from low to high at x: error bars, stems
    band,      ///< filled between low and high along x
    columns    ///< filled from low to high, as wide as their neighbours leave room
  };
  Shape shape = Shape::line;
  std::string series{};
  int colour = 0;
  std::vector<double> x{};
  std::vector<double> y{};            ///< of line and dots
  std::vector<double> low{}, high{};  ///< of the others
  std::vector<double> sigma{};        ///< of y, for the readout; may be empty
};

/// What one plot draws: layers from back to front on common axes.
struct Figure {
  Axis x, y;
  std::vector<Layer> layers;
  std::vector<Mark> marks;
};

}  // namespace takt::report
