// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/low_pass.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>

namespace takt {

namespace {

constexpr double pi = std::numbers::pi;

/// Σ i·c_i / Σ c_i: the delay of a polynomial in z⁻¹ at 0 Hz, in samples.
double centroid(const std::vector<double>& c) {
  double sum = 0, moment = 0;
  for (std::size_t i = 0; i < c.size(); ++i) {
    sum += c[i];
    moment += static_cast<double>(i) * c[i];
  }
  return moment / sum;
}

std::vector<double> hamming(double bandwidth_hz, double rate_hz) {
  // A Hamming window used as the kernel itself is −3 dB at 0.65 / length.
  const int length = std::max(1, static_cast<int>(std::lround(0.65 * rate_hz / bandwidth_hz)));
  std::vector<double> b(static_cast<std::size_t>(length), 1.0);
  for (int i = 0; i < length && length > 1; ++i)
    b[static_cast<std::size_t>(i)] = 0.54 - 0.46 * std::cos(2 * pi * i / (length - 1));
  const double sum = std::accumulate(b.begin(), b.end(), 0.0);
  for (double& w : b) w /= sum;
  return b;
}

}  // namespace

LowPass::LowPass(LowPassKind kind, double bandwidth_hz, double rate_hz) : rate_hz_(rate_hz), b_{1}, a_{1} {
  if (kind != LowPassKind::none && !(bandwidth_hz > 0 && bandwidth_hz < 0.5 * rate_hz))
    throw std::invalid_argument("LowPass: a bandwidth of " + std::to_string(bandwidth_hz) +
                                " Hz does not lie between 0 and half the rate of " + std::to_string(rate_hz) + " Hz");
  switch (kind) {
    case LowPassKind::none:
      break;
    case LowPassKind::first_order: {
      const double keep = std::exp(-2 * pi * bandwidth_hz / rate_hz);
      b_ = {1 - keep};
      a_ = {1, -keep};
      break;
    }
    case LowPassKind::second_order: {
      const double k = std::tan(pi * bandwidth_hz / rate_hz), root2 = std::numbers::sqrt2;
      const double norm = 1 / (1 + root2 * k + k * k);
      b_ = {k * k * norm, 2 * k * k * norm, k * k * norm};
      a_ = {1, 2 * (k * k - 1) * norm, (1 - root2 * k + k * k) * norm};
      break;
    }
    case LowPassKind::fir:
      b_ = hamming(bandwidth_hz, rate_hz);
      break;
  }
  x_.assign(b_.size(), Vec3::Zero());
  y_.assign(a_.size(), Vec3::Zero());
}

double LowPass::delay_s() const {
  return (centroid(b_) - centroid(a_)) / rate_hz_;
}

double LowPass::memory_s() const {
  const double fir = static_cast<double>(b_.size()) / rate_hz_;
  if (a_.size() == 1) return fir;
  // The slowest pole's radius: sqrt of the last coefficient for a complex pair, the coefficient itself for one pole.
  const double radius = a_.size() == 2 ? std::abs(a_[1]) : std::sqrt(a_[2]);
  return fir + std::log(1e-12) / std::log(radius) / rate_hz_;
}

Vec3 LowPass::step(const Vec3& x) {
  std::rotate(x_.begin(), x_.end() - 1, x_.end());
  x_[0] = x;
  Vec3 y = Vec3::Zero();
  for (std::size_t i = 0; i < b_.size(); ++i) y += b_[i] * x_[i];
  for (std::size_t i = 1; i < a_.size(); ++i) y -= a_[i] * y_[i - 1];
  std::rotate(y_.begin(), y_.end() - 1, y_.end());
  y_[0] = y;
  return y;
}

}  // namespace takt
