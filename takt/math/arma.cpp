// SPDX-License-Identifier: Apache-2.0
#include "takt/math/arma.h"

#include <algorithm>
#include <array>
#include <limits>

namespace takt {

namespace {

/// −2 log likelihood with the variance concentrated out.
double cost(std::span<const std::vector<double>> stretches, const Arma11& model) {
  double sum = 0, log_variance = 0;
  std::size_t n = 0;
  for (const auto& stretch : stretches) {
    Whitener<double> whiten(model);
    for (const double u : stretch) {
      const double e = whiten(u);
      sum += e * e;
      log_variance += std::log(whiten.step_variance());
    }
    n += stretch.size();
  }
  return static_cast<double>(n) * std::log(sum) + log_variance;
}

}  // namespace

Arma11 fit_arma11(std::span<const std::vector<double>> stretches) {
  std::size_t n = 0;
  for (const auto& s : stretches) n += s.size();
  if (n < 30) return {};
  Arma11 best;
  double best_cost = cost(stretches, best);
  if (!std::isfinite(best_cost)) return {};
  // A pattern search that halves its step: two parameters, a smooth cost, no derivative worth writing.
  std::array<double, 2> step{0.4, 0.4};
  const auto inside = [](const Arma11& m) { return m.ar > -0.7 && m.ar < 0.985 && m.ma > -0.985 && m.ma < 0.9; };
  for (int halving = 0; halving < 7;) {
    bool moved = false;
    for (const auto [da, dm] : {std::array{1., 0.}, {-1., 0.}, {0., 1.}, {0., -1.}, {1., -1.}, {-1., 1.}}) {
      const Arma11 trial{best.ar + da * step[0], best.ma + dm * step[1]};
      if (!inside(trial)) continue;
      const double c = cost(stretches, trial);
      if (c < best_cost) best = trial, best_cost = c, moved = true;
    }
    if (!moved) step = {step[0] / 2, step[1] / 2}, ++halving;
  }
  return best;
}

}  // namespace takt
