// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/problem.h"

#include <algorithm>
#include <stdexcept>

namespace takt::alignment {

namespace {

GyroCurve curve_of(const ImuStream& imu) {
  std::vector<double> t(imu.size());
  for (std::size_t i = 0; i < imu.size(); ++i) t[i] = seconds_since(imu.stamps.front(), imu.stamps[i]);
  return {std::move(t), imu.gyro_rad_s};
}

Quat rotation_of(const RotationIncrement& increment) {
  return exp_so3(increment.rotation);
}

/// Steps no finer than the reference can resolve: consecutive increments are chained until they are long enough.
std::vector<Step> chained(const RotationSignal& signal, double shortest_s) {
  std::vector<Step> steps;
  const auto& all = signal.increments;
  const Stamp epoch = all.front().from;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].information.trace() <= 0) continue;
    Quat rotation = rotation_of(all[i]);
    Mat3 covariance = Mat3::Zero();
    std::size_t last = i;
    bool merged = false;
    while (last + 1 < all.size() && seconds_since(all[i].from, all[last].to) < shortest_s &&
           all[last + 1].from == all[last].to && all[last + 1].information.trace() > 0) {
      if (!merged) covariance = all[i].information.inverse();
      ++last;
      const Mat3 turn = rotation_of(all[last]).conjugate().toRotationMatrix();
      covariance = (turn * covariance * turn.transpose() + all[last].information.inverse()).eval();
      rotation = rotation * rotation_of(all[last]);
      merged = true;
    }
    Step s;
    s.t0 = seconds_since(epoch, all[i].from);
    s.t1 = seconds_since(epoch, all[last].to);
    s.rotation = log_so3(rotation);
    s.information = merged ? Mat3(covariance.inverse()) : all[i].information;
    s.source = i;
    if (!(s.t1 > s.t0)) throw std::invalid_argument("alignment: a rotation increment does not run forward in time");
    steps.push_back(s);
    i = last;
  }
  return steps;
}

double median_length(const std::vector<Step>& steps) {
  if (steps.empty()) return 0;
  std::vector<double> lengths;
  for (const Step& s : steps) lengths.push_back(s.t1 - s.t0);
  const auto mid = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), mid, lengths.end());
  return *mid;
}

}  // namespace

Problem::Problem(const RotationSignal& s, const ImuStream& imu)
    : signal(s),
      sensor_epoch(s.increments.front().from),
      reference_epoch(imu.stamps.front()),
      reference(curve_of(imu)) {
  // A camera's bearings belong to their own pair of frames and are never chained.
  steps = chained(s, s.matches.empty() ? 1.5 * reference.median_step_s() : 0.0);
  step_s = median_length(steps);
}

}  // namespace takt::alignment
