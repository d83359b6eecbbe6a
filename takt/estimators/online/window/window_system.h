// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

/// What the window's linear system is made of, for the two files that fill it.
namespace takt::online {

/// Offsets in ms and drifts in ppm inside the system, so that its entries are of like size.
constexpr double ms = 1e-3, ppm = 1e-6;
enum ClockError { at_offset = 0, at_drift = 1, at_slip = 2 };
constexpr int clock_size = 3;

inline double squared(double x) {
  return x * x;
}

/// Wilson and Hilferty's quantile of χ² at 4 σ.
inline double most_squares(double n) {
  const double c = 2 / (9 * n), q = 1 - c + 4 * std::sqrt(c);
  return n * q * q * q;
}

}  // namespace takt::online
