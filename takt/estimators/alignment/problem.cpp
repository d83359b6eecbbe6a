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

/// The rotation that maps bearings best when translation is left out of account: biased by it, but with far less noise
/// than one that has to tell the two apart, which is what a search needs. Robust by reweighting.
Vec3 apparent_rotation(const std::vector<BearingMatch>& matches) {
  Mat3 rotation = Mat3::Identity();
  double cut = 1;
  std::vector<double> misfit(matches.size());
  for (int pass = 0; pass < 4; ++pass) {
    Mat3 correlation = Mat3::Zero();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const Vec3 from = matches[i].from.cast<double>(), to = matches[i].to.cast<double>();
      const double r = misfit[i] / cut;
      correlation += from * to.transpose() / (1 + r * r);
    }
    rotation = align_vectors(correlation).rotation;
    for (std::size_t i = 0; i < matches.size(); ++i)
      misfit[i] = (matches[i].from.cast<double>() - rotation * matches[i].to.cast<double>()).norm();
    std::vector<double> sorted = misfit;
    const auto mid = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), mid, sorted.end());
    cut = std::max(1e-6, 1.5 * *mid);
  }
  return log_so3(Quat(rotation));
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
    s.apparent = signal.matches.empty() ? s.rotation : apparent_rotation(signal.matches[i]);
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
