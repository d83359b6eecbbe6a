// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "takt/estimators/pendulum/spline_model.h"

/// What a converged SplineModel says: its unknowns with their uncertainty, residuals, and the delay stretch by stretch.
namespace takt::pendulum {

SplineModel::Answer SplineModel::answer() const {
  const Border b = border(1);
  const Eigen::MatrixXd covariance = normal_equations(b, {}).solve().border_covariance();
  const auto sigma = [&](int i) { return i < 0 ? 0.0 : std::sqrt(covariance(i, i)); };
  return {delay_s_,           sigma(b.delays),  scale_, sigma(b.scale), bias_, line_delay_, sigma(b.line_delay),
          friction_strength_, sigma(b.friction)};
}

std::vector<double> SplineModel::angle_residuals(const SplineData& data) const {
  std::vector<double> out;
  out.reserve(data.angles.size());
  for (const AngleReading& a : data.angles) {
    const double t = a.time_s + a.row * line_delay_;
    out.push_back(covers(t) ? a.angle_rad - at(t).curve.angle : 0);
  }
  return out;
}

std::vector<double> SplineModel::rate_residuals(const SplineData& data) const {
  std::vector<double> out;
  out.reserve(data.rates.size());
  // Hundreds of rates lie between two knots: the segment's polynomial is made once for all of them.
  int first = -1;
  std::array<double, order> rate{};  // of u^n
  for (const RateReading& r : data.rates) {
    const double t = r.time_s - delay_s_;
    if (!covers(t)) {
      out.push_back(0);
      continue;
    }
    const KnotPlace place = knots_.locate(t - origin_s_);
    if (place.first != first) {
      first = place.first;
      rate.fill(0);
      for (int s = 0; s < order; ++s)
        for (std::size_t n = 1; n < order; ++n)
          rate[n - 1] += static_cast<double>(n) / knots_.interval_s() * basis[s][n] * points_[first + s];
    }
    double curve = 0;
    for (std::size_t n = order; n-- > 0;) curve = curve * place.u + rate[n];
    curve += friction_strength_ * friction_.at(t).rate;
    out.push_back(r.rate_rad_s - scale_ * curve - bias_);
  }
  return out;
}

std::vector<double> SplineModel::binned_rate_residuals() const {
  std::vector<double> out;
  out.reserve(bins_.size());
  for (const RateBin& b : bins_) {
    const double t = b.time_s - delay_s_;
    out.push_back(covers(t) ? b.rate_rad_s - predicted(b, at(t)) : 0);
  }
  return out;
}

SplineModel::Leverage SplineModel::leverage() const {
  BandedMatrix information(knots_.control_points(), order - 1);
  const double angle_weight = 1 / (noise.angle_rad * noise.angle_rad);
  const double rate_weight = scale_ * scale_ / (noise.rate_rad_s * noise.rate_rad_s);
  for (const AngleReading& a : angles_) {
    const Point p = at(a.time_s + a.row * line_delay_);
    information.add_block(p.first, angle_weight * p.weights.value * p.weights.value.transpose());
  }
  for (const RateBin& b : bins_) {
    if (!covers(b.time_s - delay_s_)) continue;
    const Point p = at(b.time_s - delay_s_);
    information.add_block(p.first, rate_weight * b.count * p.weights.d1 * p.weights.d1.transpose());
  }
  ArrowSystem prior(knots_.control_points(), order - 1, 0);
  add_prior(prior);
  const Eigen::VectorXd stiffness = prior.diagonal();
  for (int i = 0; i < stiffness.size(); ++i) information(i, i) += stiffness[i];
  const BandedCholesky factor(std::move(information));
  if (!factor.ok()) return {0, 0};
  const BandedMatrix covariance = factor.selected_inverse();
  Leverage used{0, 2};  // scale and bias are the rates' own
  for (const AngleReading& a : angles_) {
    const Point p = at(a.time_s + a.row * line_delay_);
    used.angles += angle_weight * covariance.quadratic_form(p.first, p.weights.value);
  }
  for (const RateBin& b : bins_) {
    if (!covers(b.time_s - delay_s_)) continue;
    const Point p = at(b.time_s - delay_s_);
    used.rates += rate_weight * b.count * covariance.quadratic_form(p.first, p.weights.d1);
  }
  return used;
}

std::optional<SplineModel::Stretches> SplineModel::stretch_delays(const std::vector<double>& cuts_s) const {
  // Which stretch each bin belongs to; stretches with too few bins go to their predecessor.
  std::vector<int> stretch_of(bins_.size(), 0);
  std::vector<double> middle(1, 0);
  std::vector<int> count(1, 0);
  std::size_t cut = 0;
  for (std::size_t j = 0; j < bins_.size(); ++j) {
    const double t = bins_[j].time_s - delay_s_;
    while (cut < cuts_s.size() && t >= cuts_s[cut]) {
      ++cut;
      if (count.back() < 20) continue;
      count.push_back(0);
      middle.push_back(0);
    }
    stretch_of[j] = static_cast<int>(count.size()) - 1;
    ++count.back();
    middle.back() += t;
  }
  if (count.size() > 1 && count.back() < 20) {  // a short end goes to the one before
    const int last = static_cast<int>(count.size()) - 1;
    for (int& s : stretch_of) s = std::min(s, last - 1);
    middle[middle.size() - 2] += middle.back();
    count[count.size() - 2] += count.back();
    count.pop_back();
    middle.pop_back();
  }
  const int k = static_cast<int>(count.size());
  if (k < 3) return std::nullopt;
  const auto solution = normal_equations(border(k), stretch_of).solve();
  if (!solution.ok()) return std::nullopt;

  const Eigen::VectorXd delta = solution.step().segment(knots_.control_points(), k);
  const Eigen::MatrixXd covariance = solution.border_covariance().topLeftCorner(k, k);
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return std::nullopt;
  Eigen::VectorXd time(k);
  for (int i = 0; i < k; ++i) time[i] = middle[static_cast<std::size_t>(i)] / count[static_cast<std::size_t>(i)];

  // Generalised least squares of a constant and a slope.
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(k), weighted = factor.solve(ones);
  const double total = weighted.sum();
  Stretches out;
  out.epoch_s = weighted.dot(time) / total;
  const double mean = weighted.dot(delta) / total;
  const Eigen::VectorXd from_mean = delta - mean * ones;
  out.dof = k - 1;
  const double squares = from_mean.dot(factor.solve(from_mean));
  out.scatter = std::sqrt(squares / out.dof);
  const Eigen::VectorXd slope = time - out.epoch_s * ones;
  const double slope_information = slope.dot(factor.solve(slope));
  const double slope_s = factor.solve(slope).dot(delta) / slope_information;
  out.drift = slope_s;
  out.drift_sigma = 1 / std::sqrt(slope_information);
  out.scatter_about_drift = std::sqrt(std::max(0.0, squares - slope_s * slope_s * slope_information) / (out.dof - 1));
  for (int i = 0; i < k; ++i) out.delays.push_back({time[i], delay_s_ + delta[i], std::sqrt(covariance(i, i))});
  return out;
}

}  // namespace takt::pendulum
