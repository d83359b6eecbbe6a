// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>

namespace takt::pendulum {

/// amplitude·e^{−decay·τ}·cos(frequency·τ + phase) + offset, τ from `centre_s`. With decay = 0 this is [Fu2021] eq. 10.
struct Harmonic {
  double centre_s = 0;
  double amplitude = 0;
  double frequency_rad_s = 0;
  double phase_rad = 0;
  double decay_per_s = 0;
  double offset = 0;
  double rms = 0;  ///< of the residuals

  [[nodiscard]] double at(double t) const;
  /// The extremum (highest or lowest) nearest to `t`, decay left aside.
  [[nodiscard]] double extremum_near(double t) const;
};

/// Least squares over the samples in [from, to]; nothing where they are too few or do not determine the parameters.
/// `times` ascend.
[[nodiscard]] std::optional<Harmonic> fit_harmonic(std::span<const double> times, std::span<const double> values,
                                                   double from, double to, double frequency_rad_s, bool with_decay);

}  // namespace takt::pendulum
