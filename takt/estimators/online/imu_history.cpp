// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/imu_history.h"

#include <limits>

namespace takt::online {

void ImuHistory::add(double t_s, const Reading& reading) {
  samples_.push_back({t_s, reading});
}

void ImuHistory::forget_before(double t_s) {
  // Two samples before stay: the cubic's slopes need them.
  while (first_ + 3 < samples_.size() && samples_[first_ + 2].t < t_s) ++first_;
  if (first_ > 4096 && 2 * first_ > samples_.size()) {
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }
}

std::size_t ImuHistory::interval(double t) const {
  const auto begin = samples_.begin() + static_cast<std::ptrdiff_t>(first_);
  const auto after =
      std::upper_bound(begin, samples_.end(), t, [](double value, const Sample& s) { return value < s.t; });
  const auto j = static_cast<std::size_t>(after - samples_.begin());
  const std::size_t last = samples_.size() >= first_ + 2 ? samples_.size() - 2 : first_;
  return std::clamp(j > 0 ? j - 1 : 0, first_, last);
}

Reading ImuHistory::within(std::size_t j, double t) const {
  if (j + 1 >= samples_.size()) return samples_[j].reading;
  const Sample &a = samples_[j], &b = samples_[j + 1];
  const double h = b.t - a.t, u = (t - a.t) / h;
  // At the ends of what is known the slope is the interval's own.
  const auto slope = [&](std::size_t i, const Vec3 Reading::*channel) -> Vec3 {
    const std::size_t before = i > first_ ? i - 1 : i, after = i + 1 < samples_.size() ? i + 1 : i;
    const Vec3 rise = samples_[after].reading.*channel - samples_[before].reading.*channel;
    return (h / (samples_[after].t - samples_[before].t)) * rise;
  };
  const double u2 = u * u, u3 = u2 * u;
  const double h00 = 2 * u3 - 3 * u2 + 1, h10 = u3 - 2 * u2 + u, h01 = 3 * u2 - 2 * u3, h11 = u3 - u2;
  const auto cubic = [&](const Vec3 Reading::*channel) -> Vec3 {
    return h00 * (a.reading.*channel) + h10 * slope(j, channel) + h01 * (b.reading.*channel) +
           h11 * slope(j + 1, channel);
  };
  return {cubic(&Reading::gyro), cubic(&Reading::accel)};
}

Reading ImuHistory::at(double t) const {
  return within(interval(t), t);
}

Reading ImuHistory::mean(double t, double half_s) const {
  const double from = std::max(t - half_s, begin_s()), to = std::min(t + half_s, end_s());
  if (!(to > from)) return at(t);
  Reading sum;
  walk(from, to, [&](double h, const Reading& a, const Reading& b) {
    sum.gyro += 0.5 * h * (a.gyro + b.gyro);
    sum.accel += 0.5 * h * (a.accel + b.accel);
  });
  sum.gyro /= to - from, sum.accel /= to - from;
  return sum;
}

double ImuHistory::longest_gap_s(double t0, double t1) const {
  if (empty() || t0 < begin_s() || t1 > end_s()) return std::numeric_limits<double>::infinity();
  double longest = 0;
  for (std::size_t j = interval(t0); j + 1 < samples_.size() && samples_[j].t < t1; ++j)
    longest = std::max(longest, samples_[j + 1].t - samples_[j].t);
  return longest;
}

}  // namespace takt::online
