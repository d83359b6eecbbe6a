// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace takt {

/// Spectrum of a real series, zero-padded to `size` (a power of two): size/2 + 1 values.
[[nodiscard]] std::vector<std::complex<double>> spectrum(std::span<const double> series, std::size_t size);
/// Back to `size` real values.
[[nodiscard]] std::vector<double> from_spectrum(std::span<const std::complex<double>> half, std::size_t size);
[[nodiscard]] std::size_t next_power_of_two(std::size_t n);

/// Correlation coefficient of two series with holes, for every lag: r(L) of a[i] against b[i + L] over the pairs where
/// both have a value, means removed over just these pairs.
struct MaskedCorrelation {
  std::ptrdiff_t first_lag = 0;
  std::vector<double> r;      ///< 0 where fewer than `min_overlap` pairs meet
  std::vector<double> pairs;  ///< how many pairs meet
  double memory = 1;          ///< samples that carry the information of one: Σ ρa(k)·ρb(k) [Bartlett1935]
};
/// `a_valid`, `b_valid`: 1 where the series has a value, 0 where not. Lags in [first, last].
[[nodiscard]] MaskedCorrelation masked_correlation(std::span<const double> a, std::span<const double> a_valid,
                                                   std::span<const double> b, std::span<const double> b_valid,
                                                   std::ptrdiff_t first_lag, std::ptrdiff_t last_lag,
                                                   double min_overlap);

}  // namespace takt
