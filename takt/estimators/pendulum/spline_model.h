// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "takt/estimators/pendulum/dry_friction.h"
#include "takt/estimators/pendulum/joint_spline.h"
#include "takt/math/arrow_system.h"
#include "takt/motion/spline_basis.h"

namespace takt::pendulum {

struct AngleReading {
  double time_s, angle_rad, row;
};
struct RateReading {
  double time_s, rate_rad_s;
};
struct SplineData {
  std::vector<AngleReading> angles;
  std::vector<RateReading> rates;
};

/// The mean of the rates over a few hundredths of a period: fewer and whiter residuals, and nothing lost, as the model
/// is that of the mean too.
struct RateBin {
  double time_s = 0;      ///< mean
  double rate_rad_s = 0;  ///< mean
  double spread_s2 = 0;   ///< variance of the times
  double count = 0;
};

/// The unknowns of the joint fit, its normal equations (spline banded, the few others a border) and its steps.
class SplineModel {
 public:
  struct Noise {
    double angle_rad = 1e-4;
    double rate_rad_s = 1e-2;  ///< of one rate, as if its low-frequency density were white
  };
  struct Answer {
    double delay_s, delay_sigma_s, scale, scale_sigma, bias_rad_s, line_delay_s, line_delay_sigma_s, dry_friction,
        dry_friction_sigma;
  };
  /// Degrees of freedom that the spline takes from either sort of residual.
  struct Leverage {
    double angles, rates;
  };
  struct Stretches {
    std::vector<StretchDelay> delays;
    double scatter, scatter_about_drift, epoch_s, drift, drift_sigma;
    int dof;
  };

  SplineModel(const SplineTask& task, double knot_interval_s, double frame_interval_s, double rate_interval_s);

  /// Takes the data, fits the spline to the angles alone, and finds the reversals and first noise levels.
  [[nodiscard]] bool start(const SplineData& data);
  /// Takes (other) data and keeps the state.
  void take(const SplineData& data);
  /// Gauss–Newton to the end.
  [[nodiscard]] bool converge();

  [[nodiscard]] Answer answer() const;
  [[nodiscard]] Leverage leverage() const;
  [[nodiscard]] std::vector<double> angle_residuals(const SplineData& data) const;
  [[nodiscard]] std::vector<double> rate_residuals(const SplineData& data) const;
  [[nodiscard]] std::vector<double> binned_rate_residuals() const;
  [[nodiscard]] const std::vector<RateBin>& bins() const { return bins_; }
  [[nodiscard]] double rate_interval_s() const { return rate_interval_s_; }
  /// A delay of its own for each stretch between `cuts_s`, all else shared: one linear step from the solution.
  [[nodiscard]] std::optional<Stretches> stretch_delays(const std::vector<double>& cuts_s) const;

  Noise noise;

 private:
  static constexpr int order = 6;
  static constexpr BasisMatrix<order> basis = uniform_basis<order>();
  struct Point {
    int first;
    Weights<order> weights;
    PendulumState curve;     ///< spline and dry friction together
    PendulumState friction;  ///< the dry-friction curve of unit strength
  };
  /// Where the border's unknowns stand; −1: not estimated.
  struct Border {
    int delays, scale, bias, line_delay, friction, size;
  };

  [[nodiscard]] bool covers(double t) const { return knots_.contains(t - origin_s_); }
  [[nodiscard]] Point at(double t) const;
  [[nodiscard]] double predicted(const RateBin& bin, const Point& p) const;
  [[nodiscard]] Border border(int delays) const;
  /// The normal equations at the present state. `stretch_of`: which delay a bin belongs to.
  [[nodiscard]] ArrowSystem normal_equations(const Border& border, const std::vector<int>& stretch_of) const;
  void add_prior(ArrowSystem& system) const;
  [[nodiscard]] DryFriction find_reversals() const;

  SplineTask task_;
  double rate_interval_s_;
  double bin_s_;
  double origin_s_;
  UniformKnots<order> knots_;
  Eigen::VectorXd points_;
  double delay_s_, scale_, bias_ = 0, line_delay_ = 0, friction_strength_ = 0;
  DryFriction friction_;
  std::vector<AngleReading> angles_;
  std::vector<RateBin> bins_;
};

}  // namespace takt::pendulum
