// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/report/figures/figures.h"

namespace takt::report {

std::vector<Layer> stems(const Series& x, const Series& y) {
  Layer upright{.shape = Layer::Shape::segments, .series = y.name, .x = x.values};
  for (const double v : y.values) {
    upright.low.push_back(std::min(v, 0.0));
    upright.high.push_back(std::max(v, 0.0));
  }
  return {std::move(upright), {.shape = Layer::Shape::dots, .series = y.name, .x = x.values, .y = y.values}};
}

}  // namespace takt::report
