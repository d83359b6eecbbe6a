// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/gyro_curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "takt/math/median.h"
#include "takt/math/natural_spline.h"

namespace takt {

GyroCurve::GyroCurve(std::vector<double> times_s, std::vector<Vec3> rates, double gap_factor)
    : t_(std::move(times_s), gap_factor), rate_(std::move(rates)) {
  const std::size_t n = t_.size();
  if (rate_.size() != n)
    throw std::invalid_argument("GyroCurve: needs one rate a time, got " + std::to_string(n) + " times and " +
                                std::to_string(rate_.size()) + " rates");
  for (std::size_t i = 0; i < n; ++i)
    if (!rate_[i].allFinite())
      throw std::invalid_argument("GyroCurve: the rate of sample " + std::to_string(i) + " is not finite");

  curvature_.resize(n);
  t_.for_each_stretch([&](std::size_t first, std::size_t count) {
    natural_spline(t_.all().subspan(first, count), std::span<const Vec3>(rate_).subspan(first, count),
                   std::span(curvature_).subspan(first, count));
  });
  attitude_.assign(n, Quat::Identity());
  for (std::size_t j = 0; j + 1 < n; ++j)
    if (t_.together(j, j + 1))
      attitude_[j + 1] = (attitude_[j] * exp_so3(rotation_in(j, t_[j], t_[j + 1]))).normalized();
}

Vec3 GyroCurve::rate_in(std::size_t j, double t) const {
  const double h = t_[j + 1] - t_[j];
  return cubic_between(rate_[j], rate_[j + 1], curvature_[j], curvature_[j + 1], h, (t_[j + 1] - t) / h);
}

Vec3 GyroCurve::rotation_in(std::size_t j, double t0, double t1) const {
  // Two-point Gauss–Legendre Magnus step for R' = R·hat(ω): exact in the integral of the cubic, O(h⁵) in the rest.
  const double mid = 0.5 * (t0 + t1), half = 0.5 * (t1 - t0), node = half / std::sqrt(3.0);
  const Vec3 w1 = rate_in(j, mid - node), w2 = rate_in(j, mid + node);
  return half * (w1 + w2) + (half * half / std::sqrt(3.0)) * w1.cross(w2);
}

Vec3 GyroCurve::rate(double t) const {
  return rate_in(t_.interval(t), t);
}

Vec3 GyroCurve::rate_slope(double t) const {
  const std::size_t j = t_.interval(t);
  const double h = t_[j + 1] - t_[j], a = (t_[j + 1] - t) / h, b = 1 - a;
  return (rate_[j + 1] - rate_[j]) / h +
         (h / 6) * ((1 - 3 * a * a) * curvature_[j] + (3 * b * b - 1) * curvature_[j + 1]);
}

Quat GyroCurve::attitude(double t) const {
  const std::size_t j = t_.interval(t);
  if (t == t_[j]) return attitude_[j];
  if (t == t_[j + 1]) return attitude_[j + 1];
  return attitude_[j] * exp_so3(rotation_in(j, t_[j], t));
}

double GyroCurve::noise_density() const {
  // Σ binomial(6,k)² = 924: white noise of variance σ² has sixth differences of variance 924·σ².
  static constexpr std::array<double, 7> weights{1, -6, 15, -20, 15, -6, 1};
  std::vector<double> magnitudes;
  const std::size_t stride = std::max<std::size_t>(1, t_.size() / 20000);
  for (std::size_t i = 0; i + 6 < t_.size(); i += stride) {
    if (!t_.together(i, i + 6)) continue;
    Vec3 d = Vec3::Zero();
    for (std::size_t k = 0; k < 7; ++k) d += weights[k] * rate_[i + k];
    for (int axis = 0; axis < 3; ++axis) magnitudes.push_back(std::abs(d[axis]));
  }
  if (magnitudes.empty()) return 0;
  const double sigma = 1.4826 * median(std::move(magnitudes)) / std::sqrt(924.0);
  return sigma * std::sqrt(t_.median_step_s());
}

}  // namespace takt
