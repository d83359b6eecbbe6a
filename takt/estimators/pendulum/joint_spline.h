// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/estimators/pendulum/coarse.h"
#include "takt/estimators/pendulum/signals.h"
#include "takt/estimators/pendulum/swings.h"

namespace takt::pendulum {

/// What is to be fitted, times on the camera's clock.
struct SplineTask {
  double from_s = 0, to_s = 0;
  double period_s = 1;
  double rest_rad = 0;
  double amplitude_rad = 0;
  Coarse coarse;
  bool free_swing = true;      ///< then dry friction has its own column
  bool line_delay = false;     ///< estimate it
  std::vector<double> cuts_s;  ///< where one stretch of the per-stretch delays ends and the next begins
};

/// The delay of one stretch, all else shared with the others.
struct StretchDelay {
  double middle_s = 0;
  double delay_s = 0;
  double sigma_s = 0;
};

struct SplineFit {
  std::string failure;  ///< why there is no answer, or empty
  double delay_s = 0, delay_sigma_s = 0;
  double scale = 1, scale_sigma = 0;
  double bias_rad_s = 0;
  double line_delay_s = 0, line_delay_sigma_s = 0;
  double dry_friction_rad_s2 = 0, dry_friction_sigma = 0;
  double epoch_s = 0;  ///< where delay and drift are uncorrelated
  double drift = 0, drift_sigma = 0;

  double angle_sigma_rad = 0;  ///< of one reading
  double rate_density = 0;     ///< rad/s/√Hz at low frequency
  double knot_interval_s = 0;
  bool knots_halved = false;  ///< the motion is faster than a swing's
  std::size_t angles = 0, rates = 0, dropped_angles = 0, dropped_rates = 0;

  std::vector<StretchDelay> stretches;
  double scatter = 1;  ///< √(χ²/n) of the stretches' delays about their mean: 1 when σ is honest
  int scatter_dof = 0;
  double scatter_about_drift = 1;  ///< the same about the line of the drift

  std::vector<double> angle_time_s, angle_rad, angle_residual_rad;
  std::vector<double> rate_time_s, rate_rad_s, rate_residual_rad_s;  ///< means over short bins, gyro's sign and scale
};

/// Maximum likelihood of  θ_cam(t_i) = θ(t_i + row_i·line delay),  ω_imu(t_j) = scale·θ'(t_j − delay) + bias
/// with θ a quintic B-spline (plus μ times the dry-friction curve). Both noise levels come from the data.
[[nodiscard]] SplineFit fit_joint_spline(const Signals& signals, const SplineTask& task);

}  // namespace takt::pendulum
