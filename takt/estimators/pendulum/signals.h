// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/streams/streams.h"

/// What the pendulum's estimators look at: one angle and one rate in seconds from a common epoch.
namespace takt::pendulum {

struct Signals {
  Stamp epoch{};                     ///< of all times below
  std::vector<double> angle_time_s;  ///< middle of the exposure of the reference row, ascending
  std::vector<double> angle_rad;
  std::vector<double> row;          ///< rows after the reference row; zeros where unknown
  std::vector<double> rate_time_s;  ///< ascending
  std::vector<double> rate_rad_s;   ///< signed, along the principal axis of rotation
  Vec3 axis = Vec3::UnitX();        ///< that axis in the IMU's frame, its sign as yet arbitrary
  double axis_share = 0;            ///< part of the rate's variance that lies along the axis
  double frame_interval_s = 0;      ///< median
  double rate_interval_s = 0;
  double angle_noise_rad = 0;  ///< of one reading, from differences: no model of the motion behind it
  double rate_density = 0;     ///< rad/s/√Hz over the frames' interval, likewise
  std::size_t saturated = 0;   ///< rates left out because the gyro stood at its limit
  double saturation_rad_s = 0;
  std::vector<std::string> notes;   ///< repairs, in words
  double stamp_sigma_s = 0;         ///< by what stamps that come in coarse steps may be off, together
  std::vector<std::string> doubts;  ///< what may make the answer wrong though the data look well
  std::string refusal;              ///< why nothing can be done, or empty
};

/// Orders, repairs and projects. Line delay declared in the dial's timing is applied unless `line_delay_unknown`.
[[nodiscard]] Signals prepare(const AngleStream& dial, const ImuStream& imu, bool line_delay_unknown);

/// Each angle at the time of its own row.
[[nodiscard]] Signals with_line_delay(const Signals& signals, double line_delay_s);

}  // namespace takt::pendulum
