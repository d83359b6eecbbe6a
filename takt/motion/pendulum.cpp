// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/pendulum.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace takt {
namespace {

/// Terms of a step's series end below this share of the swing: a tenth of the rounding of one addition.
constexpr double negligible = 1e-17;

template <std::size_t N>
PendulumState evaluate(const std::array<double, N>& a, double t) {
  PendulumState s;
  for (std::size_t k = N; k-- > 0;) {
    s.acceleration = s.acceleration * t + 2 * s.rate;
    s.rate = s.rate * t + s.angle;
    s.angle = s.angle * t + a[k];
  }
  return s;
}

/// The first root in (0, h] of the series' velocity, given that v(h) has the other sign than v just after 0.
template <std::size_t N>
double reversal_in(const std::array<double, N>& a, double h, double direction) {
  double before = 0, after = h, t = 0.5 * h;
  for (int i = 0; i < 200; ++i) {
    const PendulumState s = evaluate(a, t);
    (s.rate * direction > 0 ? before : after) = t;
    double next = t - s.rate / s.acceleration;
    if (!(next > before && next < after)) next = 0.5 * (before + after);
    if (std::abs(next - t) <= 1e-16 * h) return next;
    t = next;
  }
  return t;
}

}  // namespace

PendulumMotion::Segment PendulumMotion::expand(double start, double angle, double rate, double direction) const {
  // sin θ and cos θ are carried as series of their own: (sin θ)' = θ'·cos θ, (cos θ)' = −θ'·sin θ.
  std::array<double, order + 1> v{}, sine{}, cosine{};
  Segment s{start, 0, {}};
  s.angle[0] = angle;
  v[0] = rate;
  sine[0] = std::sin(angle);
  cosine[0] = std::cos(angle);
  const double gravity = model_.natural_rad_s * model_.natural_rad_s;
  for (std::size_t k = 0; k < order; ++k) {
    double speed_squared = 0;
    for (std::size_t j = 0; j <= k; ++j) speed_squared += v[j] * v[k - j];
    const double accel = -gravity * sine[k] - 2 * model_.viscous_per_s * v[k] -
                         (k == 0 ? model_.coulomb_rad_s2 * direction : 0) -
                         model_.quadratic_per_rad * direction * speed_squared;
    const double n = static_cast<double>(k + 1);
    v[k + 1] = accel / n;
    s.angle[k + 1] = v[k] / n;
    for (std::size_t j = 0; j <= k; ++j) {
      const double slope = static_cast<double>(j + 1) * s.angle[j + 1] / n;
      sine[k + 1] += slope * cosine[k - j];
      cosine[k + 1] -= slope * sine[k - j];
    }
  }
  // The step at which the last two terms have become negligible against the swing itself.
  const double swing = std::abs(angle) + std::abs(rate) / model_.natural_rad_s;
  double length = 1e9;
  for (std::size_t k = order - 1; k <= order; ++k)
    if (s.angle[k] != 0)
      length = std::min(length, std::pow(negligible * swing / std::abs(s.angle[k]), 1.0 / static_cast<double>(k)));
  s.length = length;
  return s;
}

PendulumMotion::PendulumMotion(const PendulumModel& model, double angle_rad, double rate_rad_s, double duration_s,
                               double longest_step_s)
    : model_(model), duration_(duration_s) {
  if (!(model.natural_rad_s > 0)) throw std::invalid_argument("PendulumMotion: natural_rad_s must be positive");
  if (!(duration_s > 0) || !(longest_step_s > 0))
    throw std::invalid_argument("PendulumMotion: duration and longest step must be positive");
  if (model.viscous_per_s < 0 || model.coulomb_rad_s2 < 0 || model.quadratic_per_rad < 0)
    throw std::invalid_argument("PendulumMotion: friction must not be negative");

  const double gravity = model.natural_rad_s * model.natural_rad_s;
  double t = 0, angle = angle_rad, rate = rate_rad_s, total = 0;
  while (t < duration_s) {
    const bool standing = rate == 0;
    const bool held = standing && gravity * std::abs(std::sin(angle)) <= model.coulomb_rad_s2;
    double direction = rate > 0 ? 1 : -1;
    if (standing) direction = std::sin(angle) > 0 ? -1 : 1;

    Segment s{t, duration_s - t, {}};
    s.angle[0] = angle;
    if (!held) s = expand(t, angle, rate, direction);
    s.length = std::min(s.length, duration_s - t);
    if (!held) s.length = std::min(s.length, longest_step_s);

    PendulumState end = evaluate(s.angle, s.length);
    if (end.rate * direction < 0) {
      s.length = reversal_in(s.angle, s.length, direction);
      end = evaluate(s.angle, s.length);
      end.rate = 0;
      reversals_.push_back(t + s.length);
    }
    segments_.push_back(s);
    integral_before_.push_back(total);
    for (std::size_t k = order + 1; k-- > 0;)
      total += s.angle[k] * std::pow(s.length, static_cast<double>(k + 1)) / static_cast<double>(k + 1);
    angle = end.angle;
    rate = end.rate;
    t = s.start + s.length;
    if (duration_s - t < 1e-12) break;  // what is left is below the resolution of a stamp
  }
}

const PendulumMotion::Segment& PendulumMotion::segment_at(double t) const {
  if (!(t >= 0 && t <= duration_))
    throw std::out_of_range("PendulumMotion: t = " + std::to_string(t) + " s is outside [0, " +
                            std::to_string(duration_) + "] s");
  const auto after =
      std::upper_bound(segments_.begin(), segments_.end(), t, [](double x, const Segment& s) { return x < s.start; });
  return *std::prev(after);
}

PendulumState PendulumMotion::at(double t) const {
  const Segment& s = segment_at(t);
  return evaluate(s.angle, t - s.start);
}

double PendulumMotion::integral(double t) const {
  const Segment& s = segment_at(t);
  const double x = t - s.start;
  double sum = 0;
  for (std::size_t k = order + 1; k-- > 0;) sum = (sum + s.angle[k] / static_cast<double>(k + 1)) * (k ? x : 1.0);
  return integral_before_[static_cast<std::size_t>(&s - segments_.data())] + sum * x;
}

double PendulumMotion::mean_angle(double from, double to) const {
  if (!(to > from)) return at(from).angle;
  // Within one segment the difference of two large integrals would cost digits: take the mean of its series.
  const Segment& s = segment_at(from);
  if (&s != &segment_at(to)) return (integral(to) - integral(from)) / (to - from);
  const double mid = 0.5 * (from + to) - s.start, half = 0.5 * (to - from);
  // Gauss's three-point rule is exact to the sixth power of the exposure.
  const double node = half * std::sqrt(0.6);
  return (5 * evaluate(s.angle, mid - node).angle + 8 * evaluate(s.angle, mid).angle +
          5 * evaluate(s.angle, mid + node).angle) /
         18;
}

}  // namespace takt
