// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>

#include "takt/motion/gyro_curve.h"

namespace takt::alignment {

/// How a sensor turns while a frame is read, by its gyro: exact at five rows, interpolated between them.
class ReadoutTurn {
 public:
  /// Rows run over [first_row, first_row + 1], counted from the row that the frame's instant `t_s` means (fractions of
  /// the height).
  ReadoutTurn(const GyroCurve& gyro, double t_s, double readout_s, double first_row, const Vec3& bias,
              const Mat3& R_gyro_sensor)
      : first_row_(first_row) {
    for (std::size_t k = 0; k < nodes; ++k) {
      // At the ends of the gyro's samples: on at the rate of the frame's instant.
      const double end = t_s + (first_row + static_cast<double>(k) * step) * readout_s;
      const bool covered = gyro.covers(std::min(t_s, end), std::max(t_s, end));
      const Vec3 rate = gyro.rate(covered ? end : t_s) - bias;
      const Vec3 turned =
          covered ? Vec3(log_so3(gyro.between(t_s, end)) - bias * (end - t_s)) : Vec3(rate * (end - t_s));
      turned_[k] = R_gyro_sensor.transpose() * turned;
      rate_[k] = R_gyro_sensor.transpose() * rate;
    }
  }

  /// Rotation vector from the frame's instant to the row's, sensor frame.
  [[nodiscard]] Vec3 turned(double row) const { return interpolate(turned_, row); }
  /// rad/s at the row's instant, sensor frame.
  [[nodiscard]] Vec3 rate(double row) const { return interpolate(rate_, row); }

 private:
  static constexpr std::size_t nodes = 5;
  static constexpr double step = 0.25;

  /// Lagrange's polynomial through the nodes.
  [[nodiscard]] Vec3 interpolate(const std::array<Vec3, nodes>& values, double row) const {
    const double x = (row - first_row_) / step;
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < nodes; ++k) {
      double weight = 1;
      for (std::size_t j = 0; j < nodes; ++j)
        if (j != k) weight *= (x - static_cast<double>(j)) / (static_cast<double>(k) - static_cast<double>(j));
      sum += weight * values[k];
    }
    return sum;
  }

  double first_row_;
  std::array<Vec3, nodes> turned_, rate_;
};

}  // namespace takt::alignment
