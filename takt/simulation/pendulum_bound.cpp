// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/pendulum_bound.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace takt {
namespace {

/// What determines the motion from the window's start on.
struct Start {
  double angle, rate;
  PendulumModel model;
};
constexpr int of_motion = 6;

/// The start with its i-th number moved by `step`.
Start moved(Start s, int i, double step) {
  const std::array<double*, of_motion> numbers{&s.angle,
                                               &s.rate,
                                               &s.model.natural_rad_s,
                                               &s.model.viscous_per_s,
                                               &s.model.coulomb_rad_s2,
                                               &s.model.quadratic_per_rad};
  *numbers[static_cast<std::size_t>(i)] += step;
  return s;
}

PendulumMotion motion_of(const Start& s, double length_s) {
  return PendulumMotion(s.model, s.angle, s.rate, length_s);
}

}  // namespace

double pendulum_bound_s(const PendulumRig& rig, const GyroModel& gyro, double from_s, double to_s) {
  if (!(to_s > from_s && from_s >= 0 && to_s <= rig.duration_s))
    throw std::invalid_argument("pendulum_bound_s: the window must lie within the recording");
  const PendulumState state = PendulumMotion(rig.pendulum, rig.start_angle_rad, 0, rig.duration_s).at(from_s);
  // One-sided differences where friction is zero would need negative friction; a little of each keeps them central.
  Start start{state.angle, state.rate, rig.pendulum};
  const double step = 1e-6;
  start.model.viscous_per_s = std::max(start.model.viscous_per_s, 2 * step);
  start.model.coulomb_rad_s2 = std::max(start.model.coulomb_rad_s2, 2 * step);
  start.model.quadratic_per_rad = std::max(start.model.quadratic_per_rad, 2 * step);
  const double length = to_s - from_s;
  const PendulumMotion truth = motion_of(start, length);
  std::vector<PendulumMotion> plus, minus;
  for (int i = 0; i < of_motion; ++i) {
    plus.push_back(motion_of(moved(start, i, step), length));
    minus.push_back(motion_of(moved(start, i, -step), length));
  }

  // Unknowns: the motion's six, then dial zero, gyro scale, gyro bias, delay.
  constexpr int n = of_motion + 4;
  using Row = Eigen::Matrix<double, n, 1>;
  Eigen::Matrix<double, n, n> information = Eigen::Matrix<double, n, n>::Zero();
  const auto add = [&](double t, bool of_gyro, double sigma) {
    Row row = Row::Zero();
    for (int i = 0; i < of_motion; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const PendulumState p = plus[k].at(t), m = minus[k].at(t);
      row[i] = (of_gyro ? gyro.scale * (p.rate - m.rate) : p.angle - m.angle) / (2 * step);
    }
    const PendulumState s = truth.at(t);
    row[of_motion] = of_gyro ? 0 : 1;
    row[of_motion + 1] = of_gyro ? s.rate : 0;
    row[of_motion + 2] = of_gyro ? 1 : 0;
    row[of_motion + 3] = of_gyro ? -gyro.scale * s.acceleration : 0;
    information += row * row.transpose() / (sigma * sigma);
  };
  for (double t = 0; t < length; t += 1 / rig.camera.frame_rate_hz)
    add(t, false, rig.camera.angle_noise_rad / std::sqrt(static_cast<double>(rig.camera.bands)));
  // A fiftieth of a second of gyro readings at a time: the swing hardly moves meanwhile.
  const double bin = 0.02;
  for (double t = 0.5 * bin; t < length; t += bin) add(t, true, gyro.noise_density / std::sqrt(bin));

  const Row scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix<double, n, n> scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Row last = scaled.ldlt().solve(Row::Unit(n - 1));
  return std::sqrt(last[n - 1]) * scale[n - 1];
}

}  // namespace takt
