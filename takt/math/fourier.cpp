// SPDX-License-Identifier: Apache-2.0
#include "takt/math/fourier.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <unsupported/Eigen/FFT>

namespace takt {

using Complex = std::complex<double>;

std::size_t next_power_of_two(std::size_t n) {
  std::size_t p = 1;
  while (p < n) p *= 2;
  return p;
}

std::vector<Complex> spectrum(std::span<const double> series, std::size_t size) {
  if (series.size() > size) throw std::invalid_argument("spectrum: series longer than the transform");
  std::vector<double> padded(size, 0.0);
  std::copy(series.begin(), series.end(), padded.begin());
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  std::vector<Complex> out;
  fft.fwd(out, padded);
  return out;
}

std::vector<double> from_spectrum(std::span<const Complex> half, std::size_t size) {
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  std::vector<Complex> in(half.begin(), half.end());
  std::vector<double> out(size);
  fft.inv(out.data(), in.data(), static_cast<Eigen::Index>(size));
  return out;
}

namespace {

/// Σ a[i]·b[i + L] for all L, from the two spectra: index L modulo the transform's size.
std::vector<double> correlate(const std::vector<Complex>& a, const std::vector<Complex>& b, std::size_t size) {
  std::vector<Complex> product(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) product[k] = std::conj(a[k]) * b[k];
  return from_spectrum(product, size);
}

using Axes = std::array<std::vector<double>, 3>;

Axes centred(const MaskedVectors& x) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double n = 0;
  for (std::size_t i = 0; i < x.value.size(); ++i) mean += x.valid[i] * x.value[i], n += x.valid[i];
  if (n > 0) mean /= n;
  Axes out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out[axis].resize(x.value.size());
    for (std::size_t i = 0; i < x.value.size(); ++i)
      out[axis][i] = x.valid[i] * (x.value[i][static_cast<Eigen::Index>(axis)] - mean[static_cast<Eigen::Index>(axis)]);
  }
  return out;
}

std::vector<double> squared_norm(const Axes& x) {
  std::vector<double> out(x[0].size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = x[0][i] * x[0][i] + x[1][i] * x[1][i] + x[2][i] * x[2][i];
  return out;
}

/// Autocorrelation summed over the axes, from the three spectra.
std::vector<double> autocorrelation(const std::array<std::vector<Complex>, 3>& f, std::size_t size) {
  std::vector<Complex> power(f[0].size());
  for (std::size_t k = 0; k < power.size(); ++k)
    power[k] = std::norm(f[0][k]) + std::norm(f[1][k]) + std::norm(f[2][k]);
  return from_spectrum(power, size);
}

/// (Σλ)²/Σλ² of the covariance: 1 when all motion is about one axis, 3 when about all alike.
double independent_axes(const Axes& x) {
  Eigen::Matrix3d c = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < x[0].size(); ++i) {
    const Eigen::Vector3d v(x[0][i], x[1][i], x[2][i]);
    c += v * v.transpose();
  }
  return c.squaredNorm() > 0 ? c.trace() * c.trace() / c.squaredNorm() : 1;
}

/// max over rotations R of tr(Rᵀ·m): the singular values' sum, the least of them negative for an improper m.
double best_match(const Eigen::Matrix3d& m) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(m.transpose() * m, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d s = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();  // ascending
  return s[2] + s[1] + (m.determinant() < 0 ? -s[0] : s[0]);
}

}  // namespace

VectorCorrelation vector_correlation(const MaskedVectors& a, const MaskedVectors& b, std::ptrdiff_t first_lag,
                                     std::ptrdiff_t last_lag, double min_overlap) {
  if (a.value.size() != a.valid.size() || b.value.size() != b.valid.size())
    throw std::invalid_argument("vector_correlation: one validity a sample");
  VectorCorrelation out;
  out.first_lag = std::max(first_lag, -static_cast<std::ptrdiff_t>(a.value.size()) + 1);
  last_lag = std::min(last_lag, static_cast<std::ptrdiff_t>(b.value.size()) - 1);
  if (last_lag < out.first_lag) return out;

  const std::size_t size = next_power_of_two(a.value.size() + b.value.size());
  const Axes ca = centred(a), cb = centred(b);
  std::array<std::vector<Complex>, 3> fa, fb;
  for (std::size_t axis = 0; axis < 3; ++axis) fa[axis] = spectrum(ca[axis], size), fb[axis] = spectrum(cb[axis], size);
  const auto fma = spectrum(a.valid, size), fmb = spectrum(b.valid, size);
  const auto pairs = correlate(fma, fmb, size);
  const auto power_a = correlate(spectrum(squared_norm(ca), size), fmb, size);
  const auto power_b = correlate(fma, spectrum(squared_norm(cb), size), size);
  const auto count = static_cast<std::size_t>(last_lag - out.first_lag + 1);
  const auto index = [&](std::size_t i) {
    const std::ptrdiff_t lag = out.first_lag + static_cast<std::ptrdiff_t>(i);
    return static_cast<std::size_t>(lag < 0 ? lag + static_cast<std::ptrdiff_t>(size) : lag);
  };
  std::vector<Eigen::Matrix3d> cross(count);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t col = 0; col < 3; ++col) {
      const auto c = correlate(fa[col], fb[row], size);
      for (std::size_t i = 0; i < count; ++i)
        cross[i](static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(col)) = c[index(i)];
    }

  out.r.assign(count, 0.0);
  out.pairs.assign(count, 0.0);
  const double most_a = *std::max_element(power_a.begin(), power_a.end());
  const double most_b = *std::max_element(power_b.begin(), power_b.end());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = index(i);
    out.pairs[i] = std::round(pairs[k]);
    if (out.pairs[i] < std::max(3.0, min_overlap)) continue;
    // Rounding of the transform leaves some 1e-12 of the whole; below that there is no signal to correlate.
    if (power_a[k] <= 1e-9 * most_a || power_b[k] <= 1e-9 * most_b) continue;
    out.r[i] = std::clamp(best_match(cross[i]) / std::sqrt(power_a[k] * power_b[k]), 0.0, 1.0);
  }

  out.axes = std::min(independent_axes(ca), independent_axes(cb));
  const auto ra = autocorrelation(fa, size), rb = autocorrelation(fb, size);
  if (ra[0] > 0 && rb[0] > 0) {
    double memory = 0;
    for (std::size_t k = 0; k < size; ++k) memory += ra[k] / ra[0] * rb[k] / rb[0];
    out.memory = std::max(1.0, memory);
  }
  return out;
}

}  // namespace takt
