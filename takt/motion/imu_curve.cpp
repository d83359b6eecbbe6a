// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/imu_curve.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "takt/math/natural_spline.h"

namespace takt {

ImuCurve::ImuCurve(std::vector<double> times_s, std::vector<Vec3> gyro, std::vector<Vec3> accel, double gap_factor)
    : t_(std::move(times_s)), gyro_(std::move(gyro)), accel_(std::move(accel)) {
  const std::size_t n = t_.size();
  if (n < 2 || gyro_.size() != n || accel_.size() != n)
    throw std::invalid_argument("ImuCurve: needs at least 2 samples, a rate and a force each; got " +
                                std::to_string(n) + " times, " + std::to_string(gyro_.size()) + " rates and " +
                                std::to_string(accel_.size()) + " forces");
  std::vector<double> steps(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i) steps[i] = t_[i + 1] - t_[i];
  for (std::size_t i = 0; i < n; ++i)
    if ((i > 0 && !(steps[i - 1] > 0)) || !gyro_[i].allFinite() || !accel_[i].allFinite())
      throw std::invalid_argument("ImuCurve: sample " + std::to_string(i) +
                                  " is not later than the one before, or not finite");
  std::vector<double> sorted = steps;
  const auto mid = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), mid, sorted.end());
  median_step_ = *mid;

  gyro_curvature_.resize(n);
  accel_curvature_.resize(n);
  stretch_.assign(n, 0);
  std::size_t first = 0;
  for (std::size_t i = 1; i <= n; ++i) {
    if (i < n && steps[i - 1] <= gap_factor * median_step_) {
      stretch_[i] = stretch_[i - 1];
      continue;
    }
    const std::span<const double> t = std::span(t_).subspan(first, i - first);
    natural_spline(t, std::span<const Vec3>(gyro_).subspan(first, i - first),
                   std::span(gyro_curvature_).subspan(first, i - first));
    natural_spline(t, std::span<const Vec3>(accel_).subspan(first, i - first),
                   std::span(accel_curvature_).subspan(first, i - first));
    if (i == n) break;
    stretch_[i] = stretch_[i - 1] + 1;
    ++gaps_;
    first = i;
  }
}

std::size_t ImuCurve::interval(double t) const {
  if (!(t >= t_.front() && t <= t_.back()))
    throw std::out_of_range("ImuCurve: t = " + std::to_string(t) + " s is outside [" + std::to_string(t_.front()) +
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

bool ImuCurve::covers(double t0, double t1) const {
  if (!(t0 >= t_.front() && t1 <= t_.back() && t0 <= t1)) return false;
  const std::size_t first = interval(t0);
  std::size_t last = interval(t1);
  if (t1 > t_[last]) ++last;
  return stretch_[first] == stretch_[last];
}

ImuCurve::Reading ImuCurve::in(std::size_t j, double t) const {
  const double h = t_[j + 1] - t_[j], a = (t_[j + 1] - t) / h;
  return {cubic_between(gyro_[j], gyro_[j + 1], gyro_curvature_[j], gyro_curvature_[j + 1], h, a),
          cubic_between(accel_[j], accel_[j + 1], accel_curvature_[j], accel_curvature_[j + 1], h, a)};
}

}  // namespace takt
