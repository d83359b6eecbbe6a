// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace takt {

/// Second derivatives, at the samples, of the natural cubic spline through them [deBoor2001]. `t` ascends strictly; T
/// is double or a fixed-size Eigen vector. All zero for fewer than three samples. Any spans of equal length.
template <class T>
void natural_spline(std::span<const double> t, std::span<const T> y, std::span<T> curvature) {
  const std::size_t n = t.size();
  for (T& c : curvature) c = T(0 * y[0]);
  if (n < 3) return;
  std::vector<double> upper(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {  // the tridiagonal system, eliminated downward …
    const double h0 = t[i] - t[i - 1], h1 = t[i + 1] - t[i];
    const T rhs = 6 * ((y[i + 1] - y[i]) / h1 - (y[i] - y[i - 1]) / h0);
    const double pivot = 2 * (h0 + h1) - h0 * upper[i - 1];
    upper[i] = h1 / pivot;
    curvature[i] = (rhs - h0 * curvature[i - 1]) / pivot;
  }
  for (std::size_t i = n - 2; i > 0; --i) curvature[i] -= upper[i] * curvature[i + 1];  // … and back
}

/// Values of a cubic between two samples h apart: a = 1 at the first, 0 at the second.
template <class T>
[[nodiscard]] T cubic_between(const T& y0, const T& y1, const T& curvature0, const T& curvature1, double h, double a) {
  const double b = 1 - a;
  return a * y0 + b * y1 + (h * h / 6) * ((a * a * a - a) * curvature0 + (b * b * b - b) * curvature1);
}

}  // namespace takt
