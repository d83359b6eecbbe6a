// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/problem.h"

#include <algorithm>
#include <stdexcept>

#include "takt/math/median.h"

namespace takt::alignment {

namespace {

GyroCurve curve_of(const ImuStream& imu) {
  std::vector<double> t(imu.size());
  for (std::size_t i = 0; i < imu.size(); ++i) t[i] = seconds_since(imu.stamps.front(), imu.stamps[i]);
  return {std::move(t), imu.gyro_rad_s};
}

/// Steps no finer than the reference can resolve: consecutive increments are chained until they are long enough.
std::vector<Step> chained(const RotationSignal& signal, double shortest_s) {
  std::vector<Step> steps;
  const auto& all = signal.increments;
  const Stamp epoch = all.front().from;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].information.trace() <= 0) continue;
    Quat rotation = exp_so3(all[i].rotation), apparent = exp_so3(all[i].apparent);
    Mat3 covariance = Mat3::Zero();
    std::size_t last = i;
    bool merged = false;
    while (last + 1 < all.size() && seconds_since(all[i].from, all[last].to) < shortest_s &&
           all[last + 1].from == all[last].to && all[last + 1].information.trace() > 0) {
      if (!merged) covariance = all[i].information.inverse();
      ++last;
      const Quat next = exp_so3(all[last].rotation);
      const Mat3 turn = next.conjugate().toRotationMatrix();
      covariance = (turn * covariance * turn.transpose() + all[last].information.inverse()).eval();
      rotation = rotation * next;
      apparent = apparent * exp_so3(all[last].apparent);
      merged = true;
    }
    Step s;
    s.t0 = seconds_since(epoch, all[i].from);
    s.t1 = seconds_since(epoch, all[last].to);
    s.rotation = log_so3(rotation);
    s.apparent = log_so3(apparent);
    s.information = merged ? Mat3(covariance.inverse()) : all[i].information;
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
  return median(std::move(lengths));
}

}  // namespace

Problem::Problem(const RotationSignal& s, const ImuStream& imu)
    : signal(s),
      sensor_epoch(s.increments.front().from),
      reference_epoch(imu.stamps.front()),
      reference(curve_of(imu)) {
  steps = chained(s, 1.5 * reference.median_step_s());
  step_s = median_length(steps);
  for (const BearingPair& p : s.pairs)
    pairs.push_back({seconds_since(sensor_epoch, p.from), seconds_since(sensor_epoch, p.to), &p.matches});
}

}  // namespace takt::alignment
