// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <vector>

namespace takt {

/// A planar pendulum about a fixed axis:
///   θ'' = −ω0²·sin θ − 2δ·θ' − μ·sign θ' − c·|θ'|·θ'
/// [Fu2021] eq. 6 is this with sin θ ≈ θ and μ = c = 0.
struct PendulumModel {
  double natural_rad_s = 4.2226;  ///< ω0 = √(g/l); the default is l = 0.55 m
  double viscous_per_s = 0;       ///< δ
  double coulomb_rad_s2 = 0;      ///< μ: dry friction of the bearing, per moment of inertia
  double quadratic_per_rad = 0;   ///< c: drag that grows with the square of the speed
};

/// Angle (rad), rate (rad/s) and acceleration (rad/s²) at one instant.
struct PendulumState {
  double angle = 0;
  double rate = 0;
  double acceleration = 0;
};

/// The motion after a release, for every instant of [0, duration]: phase exact to 1 ns over 200 s.
///
/// Between two reversals of the velocity the equation is analytic, so each step is its Taylor series of order 22;
/// the series is also the dense output. Reversals are located as roots of the series: there dry friction turns
/// round, or holds the pendulum for good where gravity cannot overcome it.
class PendulumMotion {
 public:
  /// Throws std::invalid_argument for a non-positive ω0, duration or step, or for negative friction.
  /// `longest_step_s` only bounds the step from above: accuracy chooses it.
  PendulumMotion(const PendulumModel& model, double angle_rad, double rate_rad_s, double duration_s,
                 double longest_step_s = 0.25);

  /// State at `t` seconds after the release; outside [0, duration] throws std::out_of_range.
  [[nodiscard]] PendulumState at(double t) const;
  /// Mean angle over [from, to], exactly: what an exposure sees.
  [[nodiscard]] double mean_angle(double from, double to) const;
  /// Instants at which the velocity changed sign.
  [[nodiscard]] const std::vector<double>& reversals() const { return reversals_; }
  [[nodiscard]] double duration_s() const { return duration_; }
  [[nodiscard]] const PendulumModel& model() const { return model_; }

 private:
  static constexpr int order = 22;
  struct Segment {
    double start;
    double length;
    std::array<double, order + 1> angle;  ///< Taylor coefficients about `start`
  };

  [[nodiscard]] Segment expand(double start, double angle, double rate, double direction) const;
  [[nodiscard]] const Segment& segment_at(double t) const;
  /// ∫θ from the release to t.
  [[nodiscard]] double integral(double t) const;

  PendulumModel model_;
  double duration_;
  std::vector<Segment> segments_;
  std::vector<double> integral_before_;  ///< ∫θ from the release to each segment's start
  std::vector<double> reversals_;
};

}  // namespace takt
