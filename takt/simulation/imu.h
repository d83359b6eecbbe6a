// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "takt/motion/trajectory.h"
#include "takt/simulation/clock.h"
#include "takt/simulation/low_pass.h"
#include "takt/streams/streams.h"

namespace takt {

/// An IMU on the body. Defaults: the class of an ADIS16448 (EuRoC's noise densities).
struct SimulatedImu {
  Mat4 T_body_imu = Mat4::Identity();
  double rate_hz = 200;
  ImuNoise noise{.gyro_density = 1.7e-4, .gyro_random_walk = 2e-5, .accel_density = 2e-3, .accel_random_walk = 3e-3};
  double gyro_bias_rad_s = 0.01;  ///< σ of each axis's initial bias
  double accel_bias_m_s2 = 0.05;
  double scale_error = 0;       ///< σ of each axis's scale
  double misalignment_rad = 0;  ///< σ of each axis's tilt
  LowPassKind low_pass = LowPassKind::none;
  double bandwidth_hz = 40;
  double stamp_delay_s = 0;     ///< what the stamp is late by, besides the low-pass
  double jitter_s = 0;          ///< σ of the stamps, cut at ±45 % of the interval so that their order holds
  double drop_fraction = 0;     ///< samples that never arrive
  double gyro_step_rad_s = 0;   ///< quantisation; 0: none
  double accel_step_m_s2 = 0;   ///< quantisation; 0: none
  double gyro_range_rad_s = 0;  ///< saturation at ±range; 0: none
  double accel_range_m_s2 = 0;  ///< saturation at ±range; 0: none

  /// By how much a stamp is later than the motion it reports (s): part of the offset to be found.
  [[nodiscard]] double delay_s() const;
  /// The rate at which the sensor itself samples, before its low-pass: a multiple of `rate_hz`.
  [[nodiscard]] double internal_rate_hz() const;
};

/// What the readings make of the true vector before bias and noise: lower triangular, drawn from the seed.
[[nodiscard]] Mat3 gyro_matrix(const SimulatedImu& imu, std::uint64_t seed);
[[nodiscard]] Mat3 accel_matrix(const SimulatedImu& imu, std::uint64_t seed);

/// Samples at true times in [0, duration_s], stamped by the reference clock. Noise is white at the output and has the
/// stated density; measured = M·true + bias + noise with M lower triangular, as Kalibr has it.
[[nodiscard]] ImuStream simulate_imu(const Trajectory& truth, const SimulatedImu& imu, const SimulatedClocks& clocks,
                                     double duration_s, std::uint64_t seed);

}  // namespace takt
