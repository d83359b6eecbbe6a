// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/clock_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "takt/math/median.h"

namespace takt {

namespace {

constexpr double least_frequency_sigma = 1e-7;
constexpr double drift_sigma = 1e-8;  // 1/s, before anything is known: a bare crystal in a draught
constexpr std::size_t rejected_in_a_row = 6;

}  // namespace

Eigen::Matrix4d ClockFilter::transition(const ClockNoise& n, double dt) {
  Eigen::Matrix4d f = Eigen::Matrix4d::Identity();
  f(0, 1) = f(1, 2) = dt;
  f(0, 2) = 0.5 * dt * dt;
  f(3, 3) = n.wander_s2 > 0 ? std::exp(-dt / n.wander_time_s) : 0;
  return f;
}

/// The integral of the three noises over the step.
Eigen::Matrix4d ClockFilter::process(const ClockNoise& n, double dt) {
  Eigen::Matrix4d q = Eigen::Matrix4d::Zero();
  const double dt2 = dt * dt, dt3 = dt2 * dt;
  q(0, 0) = n.white_frequency * dt + n.walk_frequency * dt3 / 3 + n.walk_drift * dt3 * dt2 / 20;
  q(0, 1) = q(1, 0) = n.walk_frequency * dt2 / 2 + n.walk_drift * dt2 * dt2 / 8;
  q(0, 2) = q(2, 0) = n.walk_drift * dt3 / 6;
  q(1, 1) = n.walk_frequency * dt + n.walk_drift * dt3 / 3;
  q(1, 2) = q(2, 1) = n.walk_drift * dt2 / 2;
  q(2, 2) = n.walk_drift * dt;
  if (n.wander_s2 > 0) q(3, 3) = n.wander_s2 * (1 - std::exp(-2 * dt / n.wander_time_s));
  return q;
}

void ClockFilter::start(const PhaseSample& first, double frequency, double frequency_sigma) {
  z_ << first.phase_s, frequency, 0, 0;
  p_ = Covariance::Zero();
  p_(0, 0) = noise_.white_phase_s2 + noise_.wander_s2;
  p_(1, 1) = frequency_sigma * frequency_sigma;
  p_(2, 2) = drift_sigma * drift_sigma;
  p_(3, 3) = noise_.wander_s2;
  p_(0, 3) = p_(3, 0) = -noise_.wander_s2;
  t_s_ = first.t_s;
  started_ = true;
}

bool ClockFilter::observe(const PhaseSample& s, double gate_sigmas) {
  if (!started_) throw std::logic_error("ClockFilter: observe before start");
  const double dt = s.t_s - t_s_;
  if (!(dt >= 0)) throw std::invalid_argument("ClockFilter: samples must not go back in time");
  const Eigen::Matrix4d f = transition(noise_, dt);
  z_ = f * z_;
  p_ = f * p_ * f.transpose() + process(noise_, dt);
  if (rejected_ >= rejected_in_a_row && !std::isnan(s.phase_s)) {
    // So many in a row are right, and the prediction is wrong: the phase or the frequency has stepped.
    loosen(std::abs(s.phase_s - z_(0)), std::abs(s.phase_s - z_(0)) / std::max(1.0, static_cast<double>(rejected_)));
    rejected_ = 0;
  }
  z_prior_ = z_;
  p_prior_ = p_;
  t_s_ = s.t_s;
  const Eigen::Vector4d ph = p_.col(0) + p_.col(3);
  innovation_var_ = ph(0) + ph(3) + noise_.white_phase_s2;
  innovation_ = 0;
  if (std::isnan(s.phase_s)) return false;
  innovation_ = s.phase_s - z_(0) - z_(3);
  if (innovation_ * innovation_ > gate_sigmas * gate_sigmas * innovation_var_) {
    ++rejected_;
    return false;
  }
  rejected_ = 0;
  const Eigen::Vector4d gain = ph / innovation_var_;
  z_ += gain * innovation_;
  p_ -= gain * ph.transpose();
  p_ = 0.5 * (p_ + p_.transpose()).eval();
  return true;
}

ClockPrediction ClockFilter::at(double t_s) const {
  const double dt = t_s - t_s_;
  const Eigen::Matrix4d f = transition(noise_, dt);
  const State z = f * z_;
  Covariance p = f * p_ * f.transpose();
  if (dt > 0) p += process(noise_, dt);
  return {
      z(0),   z(1), z(2), std::sqrt(std::max(0.0, p(0, 0)) + noise_.unresolved_s2), std::sqrt(std::max(0.0, p(1, 1))),
      p(0, 1)};
}

void ClockFilter::loosen(double phase_sigma_s, double frequency_sigma) {
  p_(0, 0) += phase_sigma_s * phase_sigma_s;
  p_(1, 1) += frequency_sigma * frequency_sigma;
}

double rough_frequency(std::span<const PhaseSample> samples) {
  if (samples.size() < 2) return 0;
  const std::size_t lag = std::clamp<std::size_t>(samples.size() / 2, 1, 8);
  std::vector<double> slopes;
  for (std::size_t i = lag; i < std::min<std::size_t>(samples.size(), 64 + lag); ++i) {
    const double dt = samples[i].t_s - samples[i - lag].t_s;
    if (dt > 0 && std::isfinite(samples[i].phase_s - samples[i - lag].phase_s))
      slopes.push_back((samples[i].phase_s - samples[i - lag].phase_s) / dt);
  }
  if (slopes.empty()) return 0;
  return median(std::move(slopes));
}

double rough_frequency_sigma(std::span<const PhaseSample> samples, const ClockNoise& noise) {
  const double span =
      samples.size() < 2 ? 1 : samples[std::min<std::size_t>(samples.size() - 1, 8)].t_s - samples[0].t_s;
  return least_frequency_sigma + 3 * std::sqrt(2 * (noise.white_phase_s2 + noise.wander_s2)) / std::max(span, 1e-9) +
         std::sqrt(noise.white_frequency) + 10 * std::sqrt(noise.walk_frequency);
}

double noise_cost(std::span<const PhaseSample> samples, const ClockNoise& noise) {
  ClockFilter filter(noise);
  filter.start(samples.front(), rough_frequency(samples), rough_frequency_sigma(samples, noise));
  double cost = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    filter.observe(samples[i], 1e9);
    if (i < 4) continue;  // the first ones only find the state
    // Beyond 4 σ a sample speaks of itself, not of the noise.
    const double v = filter.innovation_var_s2();
    cost += 0.5 * (std::log(v) + std::min(filter.innovation_s() * filter.innovation_s() / v, 16.0));
  }
  return std::isfinite(cost) ? cost : 1e300;
}

SmoothedClock smooth(std::span<const PhaseSample> samples, const ClockNoise& noise,
                     std::span<const std::size_t> slips) {
  SmoothedClock out;
  if (samples.empty()) return out;
  const std::size_t n = samples.size();
  std::vector<ClockFilter::State> z(n), z_before(n);
  std::vector<ClockFilter::Covariance> p(n), p_before(n);
  out.used.assign(n, 1);
  out.innovations_s.assign(n, 0);
  ClockFilter filter(noise);
  filter.start(samples[0], rough_frequency(samples), rough_frequency_sigma(samples, noise));
  z[0] = z_before[0] = filter.state();
  p[0] = p_before[0] = filter.covariance();
  for (std::size_t i = 1; i < n; ++i) {
    if (std::binary_search(slips.begin(), slips.end(), i)) filter.loosen(0.05, 1e-6);
    out.used[i] = filter.observe(samples[i]);
    z_before[i] = filter.prior_state();
    p_before[i] = filter.prior_covariance();
    out.innovations_s[i] = filter.innovation_s();
    z[i] = filter.state();
    p[i] = filter.covariance();
  }
  out.at.resize(n);
  ClockFilter::State zs = z[n - 1];
  ClockFilter::Covariance ps = p[n - 1];
  for (std::size_t i = n; i-- > 0;) {
    if (i + 1 < n) {
      const Eigen::Matrix4d f = ClockFilter::transition(noise, samples[i + 1].t_s - samples[i].t_s);
      // States differ by many powers of ten: scaled to unit variance before they are inverted.
      const Eigen::Vector4d scale = p_before[i + 1].diagonal().cwiseMax(1e-60).cwiseSqrt();
      const Eigen::Matrix4d unit =
          scale.cwiseInverse().asDiagonal() * p_before[i + 1] * scale.cwiseInverse().asDiagonal();
      const Eigen::Matrix4d cross = p[i] * f.transpose() * scale.cwiseInverse().asDiagonal();
      const Eigen::Matrix4d gain =
          (unit + 1e-12 * Eigen::Matrix4d::Identity()).fullPivLu().solve(cross.transpose()).transpose() *
          scale.cwiseInverse().asDiagonal();
      zs = z[i] + gain * (zs - z_before[i + 1]);
      ps = p[i] + gain * (ps - p_before[i + 1]) * gain.transpose();
    }
    out.at[i] = {zs(0),
                 zs(1),
                 zs(2),
                 std::sqrt(std::max(0.0, ps(0, 0)) + noise.unresolved_s2),
                 std::sqrt(std::max(0.0, ps(1, 1))),
                 ps(0, 1)};
  }
  return out;
}

}  // namespace takt
