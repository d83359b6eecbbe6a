// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/report/figures/figures.h"

namespace takt::report {

std::vector<Layer> histogram(const Series& x, const Series& y) {
  Layer columns{.shape = Layer::Shape::columns, .series = y.name, .x = x.values};
  for (const double v : y.values) {
    columns.low.push_back(std::min(v, 0.0));
    columns.high.push_back(std::max(v, 0.0));
  }
  return {std::move(columns)};
}

}  // namespace takt::report
