// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/gyro_curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "takt/math/natural_spline.h"

namespace takt {

namespace {

double median(std::vector<double> v) {
  const auto mid = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), mid, v.end());
  return *mid;
}

}  // namespace

GyroCurve::GyroCurve(std::vector<double> times_s, std::vector<Vec3> rates, double gap_factor)
    : t_(std::move(times_s)), rate_(std::move(rates)) {
  if (t_.size() < 2 || t_.size() != rate_.size())
    throw std::invalid_argument("GyroCurve: needs at least 2 samples and one rate a time, got " +
                                std::to_string(t_.size()) + " times and " + std::to_string(rate_.size()) + " rates");
  std::vector<double> steps(t_.size() - 1);
  for (std::size_t i = 0; i + 1 < t_.size(); ++i) {
    steps[i] = t_[i + 1] - t_[i];
    if (!(steps[i] > 0) || !rate_[i].allFinite() || !rate_[i + 1].allFinite())
      throw std::invalid_argument("GyroCurve: sample " + std::to_string(i + 1) +
                                  " is not later than the one before, or not finite");
  }
  median_step_ = median(steps);

  const std::size_t n = t_.size();
  curvature_.assign(n, Vec3::Zero());
  attitude_.assign(n, Quat::Identity());
  stretch_.assign(n, 0);
  std::size_t first = 0;
  for (std::size_t i = 1; i <= n; ++i) {
    if (i < n && steps[i - 1] <= gap_factor * median_step_) {
      stretch_[i] = stretch_[i - 1];
      continue;
    }
    natural_spline(std::span(t_).subspan(first, i - first), std::span<const Vec3>(rate_).subspan(first, i - first),
                   std::span(curvature_).subspan(first, i - first));
    if (i < n) {
      stretch_[i] = stretch_[i - 1] + 1;
      ++gaps_;
      first = i;
    }
  }
  for (std::size_t j = 0; j + 1 < n; ++j) {
    if (stretch_[j] != stretch_[j + 1]) continue;
    attitude_[j + 1] = (attitude_[j] * exp_so3(rotation_in(j, t_[j], t_[j + 1]))).normalized();
  }
}

std::size_t GyroCurve::interval(double t) const {
  if (!(t >= t_.front() && t <= t_.back()))
    throw std::out_of_range("GyroCurve: t = " + std::to_string(t) + " s is outside [" + std::to_string(t_.front()) +
                            ", " + std::to_string(t_.back()) + "]");
  // Nearly uniform samples: guess from the mean step, then walk; fall back to bisection after a few steps.
  const std::size_t last = t_.size() - 2;
  const double mean_step = (t_.back() - t_.front()) / static_cast<double>(t_.size() - 1);
  std::size_t j = std::min(last, static_cast<std::size_t>((t - t_.front()) / mean_step));
  for (int i = 0; i < 8; ++i) {
    if (t < t_[j])
      --j;
    else if (j < last && t >= t_[j + 1])
      ++j;
    else
      return j;
  }
  const auto after = std::upper_bound(t_.begin(), t_.end(), t);
  return std::min(last, static_cast<std::size_t>(after - t_.begin()) - 1);
}

bool GyroCurve::covers(double t0, double t1) const {
  if (!(t0 >= t_.front() && t1 <= t_.back() && t0 <= t1)) return false;
  const std::size_t first = interval(t0);
  std::size_t last = interval(t1);
  if (t1 > t_[last]) ++last;
  return stretch_[first] == stretch_[last];
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
  return rate_in(interval(t), t);
}

Vec3 GyroCurve::rate_slope(double t) const {
  const std::size_t j = interval(t);
  const double h = t_[j + 1] - t_[j], a = (t_[j + 1] - t) / h, b = 1 - a;
  return (rate_[j + 1] - rate_[j]) / h +
         (h / 6) * ((1 - 3 * a * a) * curvature_[j] + (3 * b * b - 1) * curvature_[j + 1]);
}

Quat GyroCurve::attitude(double t) const {
  const std::size_t j = interval(t);
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
    if (stretch_[i] != stretch_[i + 6]) continue;
    Vec3 d = Vec3::Zero();
    for (std::size_t k = 0; k < 7; ++k) d += weights[k] * rate_[i + k];
    for (int axis = 0; axis < 3; ++axis) magnitudes.push_back(std::abs(d[axis]));
  }
  if (magnitudes.empty()) return 0;
  const double sigma = 1.4826 * median(std::move(magnitudes)) / std::sqrt(924.0);
  return sigma * std::sqrt(median_step_);
}

}  // namespace takt
