// SPDX-License-Identifier: Apache-2.0
#include "takt/report/figures/figures.h"

namespace takt::report {

std::vector<Layer> lines(const Series& x, const Series& y) {
  std::vector<Layer> layers;
  if (!y.sigma.empty()) {
    Layer band{.shape = Layer::Shape::band, .series = y.name, .x = x.values};
    for (std::size_t i = 0; i < y.values.size(); ++i) {
      band.low.push_back(y.values[i] - y.sigma[i]);
      band.high.push_back(y.values[i] + y.sigma[i]);
    }
    layers.push_back(std::move(band));
  }
  layers.push_back({.shape = Layer::Shape::line, .series = y.name, .x = x.values, .y = y.values, .sigma = y.sigma});
  return layers;
}

}  // namespace takt::report
