// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/motion/sample_times.h"

namespace takt {

/// Rates and specific forces of an IMU as functions of continuous time, by C² cubic splines through the samples.
/// Times are seconds after an epoch of the caller's choice. The curve breaks at gaps; nothing is bridged.
class ImuCurve {
 public:
  struct Reading {
    Vec3 gyro;   ///< rad/s
    Vec3 accel;  ///< m/s²
  };

  /// Strictly increasing finite times, one rate (rad/s) and one specific force (m/s²) each; throws
  /// std::invalid_argument otherwise. A gap is a step of more than `gap_factor` times the median step.
  ImuCurve(std::vector<double> times_s, std::vector<Vec3> gyro, std::vector<Vec3> accel, double gap_factor = 3.5);

  [[nodiscard]] double begin_s() const { return t_.begin_s(); }
  [[nodiscard]] double end_s() const { return t_.end_s(); }
  [[nodiscard]] double median_step_s() const { return t_.median_step_s(); }
  [[nodiscard]] std::size_t gaps() const { return t_.gaps(); }
  /// Whether [t0, t1] lies within the samples and contains no gap.
  [[nodiscard]] bool covers(double t0, double t1) const { return t_.covers(t0, t1); }

  [[nodiscard]] std::span<const double> times_s() const { return t_.all(); }
  [[nodiscard]] std::span<const Vec3> gyro() const { return gyro_; }
  [[nodiscard]] std::span<const Vec3> accel() const { return accel_; }

  /// The sample interval [t_j, t_j+1] that holds t; throws std::out_of_range outside the samples.
  [[nodiscard]] std::size_t interval(double t) const { return t_.interval(t); }
  /// Needs covers(t, t).
  [[nodiscard]] Reading at(double t) const { return in(interval(t), t); }
  /// The same within a known interval.
  [[nodiscard]] Reading in(std::size_t interval, double t) const;

 private:
  SampleTimes t_;
  std::vector<Vec3> gyro_, accel_;
  std::vector<Vec3> gyro_curvature_, accel_curvature_;
};

}  // namespace takt
