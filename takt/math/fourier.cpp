// SPDX-License-Identifier: Apache-2.0
#include "takt/math/fourier.h"

#include <algorithm>
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

std::vector<double> centred(std::span<const double> x, std::span<const double> valid) {
  double sum = 0, n = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += valid[i] * x[i], n += valid[i];
  std::vector<double> out(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = valid[i] * (x[i] - (n > 0 ? sum / n : 0));
  return out;
}

std::vector<double> squared(std::vector<double> x) {
  for (double& v : x) v *= v;
  return x;
}

}  // namespace

MaskedCorrelation masked_correlation(std::span<const double> a, std::span<const double> a_valid,
                                     std::span<const double> b, std::span<const double> b_valid,
                                     std::ptrdiff_t first_lag, std::ptrdiff_t last_lag, double min_overlap) {
  if (a.size() != a_valid.size() || b.size() != b_valid.size())
    throw std::invalid_argument("masked_correlation: one validity a sample");
  MaskedCorrelation out;
  out.first_lag = std::max(first_lag, -static_cast<std::ptrdiff_t>(a.size()) + 1);
  last_lag = std::min(last_lag, static_cast<std::ptrdiff_t>(b.size()) - 1);
  if (last_lag < out.first_lag) return out;

  const std::size_t size = next_power_of_two(a.size() + b.size());
  const std::vector<double> ca = centred(a, a_valid), cb = centred(b, b_valid);
  const auto fa = spectrum(ca, size), fb = spectrum(cb, size);
  const auto fma = spectrum(a_valid, size), fmb = spectrum(b_valid, size);
  const auto pairs = correlate(fma, fmb, size);
  const auto ab = correlate(fa, fb, size);
  const auto sum_a = correlate(fa, fmb, size), sum_b = correlate(fma, fb, size);
  const auto sum_aa = correlate(spectrum(squared(ca), size), fmb, size);
  const auto sum_bb = correlate(fma, spectrum(squared(cb), size), size);

  const auto count = static_cast<std::size_t>(last_lag - out.first_lag + 1);
  out.r.assign(count, 0.0);
  out.pairs.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::ptrdiff_t lag = out.first_lag + static_cast<std::ptrdiff_t>(i);
    const auto k = static_cast<std::size_t>(lag < 0 ? lag + static_cast<std::ptrdiff_t>(size) : lag);
    const double n = std::round(pairs[k]);
    out.pairs[i] = n;
    if (n < std::max(3.0, min_overlap)) continue;
    const double va = sum_aa[k] - sum_a[k] * sum_a[k] / n, vb = sum_bb[k] - sum_b[k] * sum_b[k] / n;
    // Rounding of the transform leaves some 1e-12 of the whole; below that there is no signal to correlate.
    if (va <= 1e-9 * sum_aa[k] || vb <= 1e-9 * sum_bb[k] || !(va > 0 && vb > 0)) continue;
    out.r[i] = std::clamp((ab[k] - sum_a[k] * sum_b[k] / n) / std::sqrt(va * vb), -1.0, 1.0);
  }

  std::vector<Complex> power_a(fa.size()), power_b(fb.size());
  for (std::size_t k = 0; k < fa.size(); ++k) power_a[k] = std::norm(fa[k]), power_b[k] = std::norm(fb[k]);
  const auto ra = from_spectrum(power_a, size), rb = from_spectrum(power_b, size);
  if (ra[0] > 0 && rb[0] > 0) {
    double memory = 0;
    for (std::size_t k = 0; k < size; ++k) memory += ra[k] / ra[0] * rb[k] / rb[0];
    out.memory = std::max(1.0, memory);
  }
  return out;
}

}  // namespace takt
