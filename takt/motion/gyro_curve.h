// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/motion/sample_times.h"

namespace takt {

/// The rotation that a gyro saw, as a function of continuous time: the rates are interpolated by a C² cubic spline and
/// integrated on SO(3) to fourth order (Magnus expansion), so that a motion of bandwidth f sampled at r Hz costs an
/// error of order (f/r)⁴, where the rectangle rule would cost half a sample of time offset.
/// Times are seconds after an epoch of the caller's choice. The curve breaks at gaps; nothing is bridged.
class GyroCurve {
 public:
  /// Strictly increasing finite times (throws std::invalid_argument otherwise), one rate (rad/s, body frame) each.
  /// A gap is a step of more than `gap_factor` times the median step.
  GyroCurve(std::vector<double> times_s, std::vector<Vec3> rates, double gap_factor = 3.5);

  [[nodiscard]] double begin_s() const { return t_.begin_s(); }
  [[nodiscard]] double end_s() const { return t_.end_s(); }
  [[nodiscard]] double median_step_s() const { return t_.median_step_s(); }
  [[nodiscard]] std::size_t gaps() const { return t_.gaps(); }

  /// Whether [t0, t1] lies within the samples and contains no gap.
  [[nodiscard]] bool covers(double t0, double t1) const { return t_.covers(t0, t1); }

  /// All below need covers(t, t) (std::out_of_range otherwise).
  [[nodiscard]] Vec3 rate(double t) const;
  /// Time derivative of the rate (rad/s²).
  [[nodiscard]] Vec3 rate_slope(double t) const;
  /// R_0_t: takes vectors from the body frame at `t` to the body frame at the first sample of the same stretch.
  [[nodiscard]] Quat attitude(double t) const;
  /// R_t0_t1 over a covered interval.
  [[nodiscard]] Quat between(double t0, double t1) const { return attitude(t0).conjugate() * attitude(t1); }

  /// White noise of the rates as a continuous density (rad/s/√Hz), measured from their sixth differences, which a
  /// motion well below the Nyquist rate hardly enters.
  [[nodiscard]] double noise_density() const;

  [[nodiscard]] std::span<const double> times_s() const { return t_.all(); }
  [[nodiscard]] std::span<const Vec3> rates() const { return rate_; }

 private:
  [[nodiscard]] Vec3 rate_in(std::size_t j, double t) const;
  [[nodiscard]] Vec3 rotation_in(std::size_t j, double t0, double t1) const;

  SampleTimes t_;
  std::vector<Vec3> rate_;
  std::vector<Vec3> curvature_;  ///< second derivative of the rate spline at the samples
  std::vector<Quat> attitude_;   ///< at the samples, from the stretch's first sample
};

}  // namespace takt
