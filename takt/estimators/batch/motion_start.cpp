// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/motion_start.h"

#include <algorithm>

namespace takt::batch {

namespace {

/// The same curve over another stretch of time; held beyond its ends.
BiasCurve stretched(const BiasCurve& from, double begin_s, double end_s) {
  BiasCurve out(begin_s, end_s, from.knots.interval_s());
  for (int k = 0; k < out.points(); ++k) {
    const double t = begin_s + (k - 0.5 * (BiasCurve::order - 2)) * out.knots.interval_s();
    const BiasCurve::Place at = from.at(t);
    out.gyro_points.col(k) = from.gyro(at);
    out.accel_points.col(k) = from.accel(at);
  }
  return out;
}

/// With t_body = t_cam + a(t) from one pair and t_imu = t_cam + b(t) from the other.
ImuLink further_imu(const CameraLink& to_body, const DiscreteFit& pair) {
  const CameraLink& to_imu = pair.calibration.cameras[0];
  ImuLink out;
  out.T_body_imu = to_body.T_imu_cam * to_imu.T_imu_cam.inverse();
  out.centre_s = to_imu.imu_time(to_imu.centre_s);
  out.offset_s = to_body.imu_time(to_imu.centre_s) - out.centre_s;
  out.drift = to_body.drift - to_imu.drift;
  out.bias = pair.calibration.imus[0].bias;
  return out;
}

}  // namespace

MotionStart join_pairs(const std::vector<const DiscreteFit*>& cameras, const std::vector<const DiscreteFit*>& imus) {
  MotionStart out;
  out.calibration = cameras.front()->calibration;
  out.calibration.cameras.clear();
  for (const DiscreteFit* pair : cameras) {
    const CameraLink& link = pair->calibration.cameras[0];
    out.calibration.cameras.push_back(link);
    out.chains.push_back(pair->chain);
    for (std::size_t k = 0; k < pair->chain.size(); ++k)
      out.anchors.push_back({link.imu_time(pair->chain[k].time_s, pair->chain[k].mean_row), pair->states[k]});
  }
  std::ranges::stable_sort(out.anchors, {}, &Anchor::time_s);
  const double begin = out.anchors.front().time_s, end = out.anchors.back().time_s;
  ImuLink& body = out.calibration.imus[0];
  if (cameras.size() > 1) body.bias = stretched(body.bias, begin, end);
  for (const DiscreteFit* pair : imus) {
    ImuLink link = further_imu(out.calibration.cameras[0], *pair);
    link.bias = stretched(link.bias, begin - link.offset_s, end - link.offset_s);
    out.calibration.imus.push_back(std::move(link));
  }
  return out;
}

}  // namespace takt::batch
