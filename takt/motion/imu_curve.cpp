// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/imu_curve.h"

#include <stdexcept>
#include <string>

#include "takt/math/natural_spline.h"

namespace takt {

ImuCurve::ImuCurve(std::vector<double> times_s, std::vector<Vec3> gyro, std::vector<Vec3> accel, double gap_factor)
    : t_(std::move(times_s), gap_factor), gyro_(std::move(gyro)), accel_(std::move(accel)) {
  const std::size_t n = t_.size();
  if (gyro_.size() != n || accel_.size() != n)
    throw std::invalid_argument("ImuCurve: needs a rate and a force a time; got " + std::to_string(n) + " times, " +
                                std::to_string(gyro_.size()) + " rates and " + std::to_string(accel_.size()) +
                                " forces");
  for (std::size_t i = 0; i < n; ++i)
    if (!gyro_[i].allFinite() || !accel_[i].allFinite())
      throw std::invalid_argument("ImuCurve: sample " + std::to_string(i) + " is not finite");
  gyro_curvature_.resize(n);
  accel_curvature_.resize(n);
  t_.for_each_stretch([&](std::size_t first, std::size_t count) {
    const auto spline = [&](std::span<const Vec3> y, std::span<Vec3> curvature) {
      natural_spline(t_.all().subspan(first, count), y.subspan(first, count), curvature.subspan(first, count));
    };
    spline(gyro_, gyro_curvature_);
    spline(accel_, accel_curvature_);
  });
}

ImuCurve::Reading ImuCurve::in(std::size_t j, double t) const {
  const double h = t_[j + 1] - t_[j], a = (t_[j + 1] - t) / h;
  return {cubic_between(gyro_[j], gyro_[j + 1], gyro_curvature_[j], gyro_curvature_[j + 1], h, a),
          cubic_between(accel_[j], accel_[j + 1], accel_curvature_[j], accel_curvature_[j + 1], h, a)};
}

}  // namespace takt
