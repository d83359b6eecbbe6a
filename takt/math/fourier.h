// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
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

/// Three-axis series with holes: `valid` is 1 where there is a value, 0 where not.
struct MaskedVectors {
  std::vector<Eigen::Vector3d> value;
  std::vector<double> valid;
};

/// Correlation of two vector series under the best rotation between them, for every lag: r(L) over the pairs
/// a[i], b[i + L] where both have a value, in [0, 1]. The rotation maximises Σ b·R·a, so what is left is
/// (σ1 + σ2 ± σ3) of the 3×3 correlation matrix over the norms: no axis needs to be known, and unlike |a| against |b|
/// nothing is lost to the norm. Means are removed over the whole of each series.
struct VectorCorrelation {
  std::ptrdiff_t first_lag = 0;
  std::vector<double> r;      ///< 0 where fewer than `min_overlap` pairs meet
  std::vector<double> pairs;  ///< how many pairs meet
  double memory = 1;          ///< samples that carry the information of one: Σ ρa(k)·ρb(k) [Bartlett1935]
  double axes = 1;            ///< how many independent axes the motion has, 1 to 3
};
/// Lags in [first, last].
[[nodiscard]] VectorCorrelation vector_correlation(const MaskedVectors& a, const MaskedVectors& b,
                                                   std::ptrdiff_t first_lag, std::ptrdiff_t last_lag,
                                                   double min_overlap);

}  // namespace takt
