// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/harmonic_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace takt::pendulum {
namespace {

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;

}  // namespace

double Harmonic::at(double t) const {
  const double x = t - centre_s;
  return amplitude * std::exp(-decay_per_s * x) * std::cos(frequency_rad_s * x + phase_rad) + offset;
}

double Harmonic::extremum_near(double t) const {
  const double turns = (frequency_rad_s * (t - centre_s) + phase_rad) / std::numbers::pi;
  return centre_s + (std::numbers::pi * std::round(turns) - phase_rad) / frequency_rad_s;
}

std::optional<Harmonic> fit_harmonic(std::span<const double> times, std::span<const double> values, double from,
                                     double to, double frequency_rad_s, bool with_decay) {
  const auto first = static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), from) - times.begin());
  const auto last = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), to) - times.begin());
  if (last < first + 10) return std::nullopt;

  // y = e^{−δτ}·(a·cos wτ + b·sin wτ) + p; Gauss–Newton in (a, b, p, w, δ). The first step is linear: a, b, p only.
  Harmonic h;
  h.centre_s = 0.5 * (from + to);
  double a = 0, b = 0, p = 0, w = frequency_rad_s, decay = 0, squares = 0;
  for (int iteration = 0; iteration < 12; ++iteration) {
    Mat5 normal = Mat5::Zero();
    Vec5 right = Vec5::Zero();
    squares = 0;
    for (std::size_t i = first; i < last; ++i) {
      const double x = times[i] - h.centre_s, size = std::exp(-decay * x);
      const double c = size * std::cos(w * x), s = size * std::sin(w * x);
      const double wave = a * c + b * s, residual = values[i] - wave - p;
      Vec5 row;
      row << c, s, 1, x * (b * c - a * s), -x * wave;
      normal.noalias() += row * row.transpose();
      right += residual * row;
      squares += residual * residual;
    }
    const int unknowns = iteration == 0 ? 3 : with_decay ? 5 : 4;
    const Eigen::MatrixXd active = normal.topLeftCorner(unknowns, unknowns);
    const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(active);
    if (factor.info() != Eigen::Success) return std::nullopt;
    const Eigen::VectorXd step = factor.solve(right.head(unknowns));
    a += step[0];
    b += step[1];
    p += step[2];
    if (unknowns > 3) w += step[3];
    if (unknowns > 4) decay += step[4];
    if (!(w > 0.5 * frequency_rad_s && w < 2 * frequency_rad_s)) return std::nullopt;
    // 1e-10 of a turn is less than a nanosecond.
    if (unknowns > 3 && std::abs(step[3]) < 1e-10 * w && std::hypot(step[0], step[1]) < 1e-10 * std::hypot(a, b)) break;
  }
  h.amplitude = std::hypot(a, b);
  h.phase_rad = std::atan2(-b, a);
  h.frequency_rad_s = w;
  h.decay_per_s = decay;
  h.offset = p;
  h.rms = std::sqrt(squares / static_cast<double>(last - first));
  return h;
}

}  // namespace takt::pendulum
