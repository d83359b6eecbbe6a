// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/report/figure.h"

/// One function a kind of series; a new kind is a new file and one row in figures.cpp.
namespace takt::report {

/// A line; with σ, a band of ±1 σ behind it.
[[nodiscard]] std::vector<Layer> lines(const Series& x, const Series& y);
/// Dots; with σ, error bars of ±1 σ behind them.
[[nodiscard]] std::vector<Layer> points(const Series& x, const Series& y);
/// Dots on stems that stand on zero.
[[nodiscard]] std::vector<Layer> stems(const Series& x, const Series& y);
/// Columns that stand on zero: counts against the middles of their bins.
[[nodiscard]] std::vector<Layer> histogram(const Series& x, const Series& y);

/// A panel as figures, one for each unit among its series; they share the x axis.
[[nodiscard]] std::vector<Figure> figures_of(const Panel& panel);

}  // namespace takt::report
