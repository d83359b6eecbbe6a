// SPDX-License-Identifier: Apache-2.0
#include "takt/report/figures/figures.h"

namespace takt::report {

std::vector<Layer> points(const Series& x, const Series& y) {
  std::vector<Layer> layers;
  if (!y.sigma.empty()) {
    Layer bars{.shape = Layer::Shape::segments, .series = y.name, .x = x.values};
    for (std::size_t i = 0; i < y.values.size(); ++i) {
      bars.low.push_back(y.values[i] - y.sigma[i]);
      bars.high.push_back(y.values[i] + y.sigma[i]);
    }
    layers.push_back(std::move(bars));
  }
  layers.push_back({.shape = Layer::Shape::dots, .series = y.name, .x = x.values, .y = y.values, .sigma = y.sigma});
  return layers;
}

}  // namespace takt::report
