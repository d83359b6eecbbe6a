// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/spline_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace takt::pendulum {
namespace {

/// The spline reaches beyond the data, so that a step of the delay or the line delay stays on it.
constexpr double margin_s = 0.1;

double rms_of_sixth_differences(const std::vector<RateBin>& bins) {
  constexpr std::array<double, 7> binomial{1, -6, 15, -20, 15, -6, 1};  // squares sum to 924
  double squares = 0;
  int n = 0;
  for (std::size_t i = 0; i + 6 < bins.size(); ++i, ++n) {
    double d = 0;
    for (std::size_t k = 0; k < 7; ++k) d += binomial[k] * bins[i + k].rate_rad_s;
    squares += d * d / 924;
  }
  return n > 0 ? std::sqrt(squares / n) : 0;
}

}  // namespace

SplineModel::SplineModel(const SplineTask& task, double knot_interval_s, double frame_interval_s,
                         double rate_interval_s)
    : task_(task),
      rate_interval_s_(rate_interval_s),
      bin_s_(std::max(std::min({task.period_s / 75, knot_interval_s / 4, 2 * frame_interval_s}), rate_interval_s)),
      origin_s_(task.from_s - margin_s),
      knots_(UniformKnots<order>::covering(task.to_s - task.from_s + 2 * margin_s, knot_interval_s)),
      points_(Eigen::VectorXd::Constant(knots_.control_points(), task.rest_rad)),
      delay_s_(task.coarse.delay_s),
      scale_(task.coarse.scale) {}

SplineModel::Point SplineModel::at(double t) const {
  const KnotPlace place = knots_.locate(t - origin_s_);
  Point p;
  p.first = place.first;
  p.weights = weights_at<order, 2>(basis, place.u, knots_.interval_s());
  const auto active = points_.segment<order>(place.first);
  p.curve = {active.dot(p.weights.value), active.dot(p.weights.d1), active.dot(p.weights.d2)};
  p.friction = friction_.at(t);
  p.curve.angle += friction_strength_ * p.friction.angle;
  p.curve.rate += friction_strength_ * p.friction.rate;
  p.curve.acceleration += friction_strength_ * p.friction.acceleration;
  return p;
}

double SplineModel::predicted(const RateBin& bin, const Point& p) const {
  // The mean over a bin is the value at its mean time and half the variance of the times in curvature: θ''' ≈ −w²·θ'.
  const double w = 2 * std::numbers::pi / task_.period_s;
  return scale_ * (1 - 0.5 * bin.spread_s2 * w * w) * p.curve.rate + bias_;
}

void SplineModel::take(const SplineData& data) {
  angles_ = data.angles;
  bins_.clear();
  for (std::size_t j = 0; j < data.rates.size();) {
    RateBin bin;
    const double start = data.rates[j].time_s;
    double squares = 0;
    for (; j < data.rates.size() && data.rates[j].time_s < start + bin_s_ * (1 - 1e-6); ++j) {
      const double x = data.rates[j].time_s - start;
      bin.time_s += x;
      squares += x * x;
      bin.rate_rad_s += data.rates[j].rate_rad_s;
      bin.count += 1;
    }
    bin.time_s /= bin.count;
    bin.rate_rad_s /= bin.count;
    bin.spread_s2 = squares / bin.count - bin.time_s * bin.time_s;
    bin.time_s += start;
    bins_.push_back(bin);
  }
}

void SplineModel::add_prior(ArrowSystem& system) const {
  // Where data are missing the motion is a pendulum's, give or take all of its acceleration: this holds the spline
  // through gaps and weighs 1e-8 of the data elsewhere.
  const double w = 2 * std::numbers::pi / task_.period_s;
  const double weight = 1 / (w * w * task_.amplitude_rad);
  Eigen::MatrixXd row(1, order);
  Eigen::VectorXd residual(1);
  const Weights<order> weights = weights_at<order, 2>(basis, 0.5, knots_.interval_s());
  for (int k = 0; k < knots_.segments(); ++k) {
    const auto active = points_.segment<order>(k);
    row = weight * (weights.d2 + w * w * weights.value).transpose();
    residual[0] = weight * (active.dot(weights.d2) + w * w * (active.dot(weights.value) - task_.rest_rad));
    const ArrowSystem::Block block{k, order};
    system.accumulate_residual({&block, 1}, row, residual);
  }
}

bool SplineModel::start(const SplineData& data) {
  take(data);
  // Angles alone determine the spline; a border of nothing.
  ArrowSystem system(knots_.control_points(), order - 1, 0);
  Eigen::MatrixXd row(1, order);
  Eigen::VectorXd residual(1);
  for (const AngleReading& a : angles_) {
    const Point p = at(a.time_s);
    row = p.weights.value.transpose() / noise.angle_rad;
    residual[0] = (p.curve.angle - a.angle_rad) / noise.angle_rad;
    const ArrowSystem::Block block{p.first, order};
    system.accumulate_residual({&block, 1}, row, residual);
  }
  add_prior(system);
  const auto solution = system.solve();
  if (!solution.ok()) return false;
  points_ += solution.step();
  if (task_.free_swing) friction_ = find_reversals();
  double squares = 0;
  for (const AngleReading& a : angles_) squares += std::pow(at(a.time_s).curve.angle - a.angle_rad, 2);
  noise.angle_rad = std::max(1.05 * std::sqrt(squares / static_cast<double>(angles_.size())), 1e-10);
  double count = 0;
  for (const RateBin& b : bins_) count += b.count / static_cast<double>(bins_.size());
  noise.rate_rad_s = std::max(rms_of_sixth_differences(bins_) * std::sqrt(count), 1e-9);
  return true;
}

DryFriction SplineModel::find_reversals() const {
  std::vector<double> reversals;
  bool first_rising = true;
  const double step = task_.period_s / 24;
  double before = task_.from_s, rate_before = at(before).curve.rate;
  for (double t = before + step; t <= task_.to_s; t += step) {
    const double rate = at(t).curve.rate;
    if (rate * rate_before < 0) {
      double low = before, high = t;
      for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        (at(middle).curve.rate * rate_before > 0 ? low : high) = middle;
      }
      if (reversals.empty()) first_rising = rate > 0;
      reversals.push_back(0.5 * (low + high));
    }
    before = t;
    rate_before = rate;
  }
  return DryFriction(std::move(reversals), first_rising);
}

SplineModel::Border SplineModel::border(int delays) const {
  Border b{0, delays, delays + 1, -1, -1, delays + 2};
  if (task_.line_delay) b.line_delay = b.size++;
  if (!friction_.empty()) b.friction = b.size++;
  return b;
}

ArrowSystem SplineModel::normal_equations(const Border& b, const std::vector<int>& stretch_of) const {
  const int n = knots_.control_points();
  ArrowSystem system(n, order - 1, b.size);
  Eigen::VectorXd residual(1);
  {
    std::vector<ArrowSystem::Block> blocks{{0, order}};
    if (b.line_delay >= 0) blocks.push_back({n + b.line_delay, 1});
    if (b.friction >= 0) blocks.push_back({n + b.friction, 1});
    Eigen::MatrixXd row(1, order + static_cast<int>(blocks.size()) - 1);
    for (const AngleReading& a : angles_) {
      const double t = a.time_s + a.row * line_delay_;
      if (!covers(t)) continue;
      const Point p = at(t);
      blocks[0].first = p.first;
      row.leftCols<order>() = p.weights.value.transpose();
      int column = order;
      if (b.line_delay >= 0) row(0, column++) = p.curve.rate * a.row;
      if (b.friction >= 0) row(0, column++) = p.friction.angle;
      row /= noise.angle_rad;
      residual[0] = (p.curve.angle - a.angle_rad) / noise.angle_rad;
      system.accumulate_residual(blocks, row, residual);
    }
  }
  std::vector<ArrowSystem::Block> blocks{{0, order}, {0, 1}, {n + b.scale, 2}};
  if (b.friction >= 0) blocks.push_back({n + b.friction, 1});
  Eigen::MatrixXd row(1, order + 3 + (b.friction >= 0));
  for (std::size_t j = 0; j < bins_.size(); ++j) {
    const RateBin& bin = bins_[j];
    const double t = bin.time_s - delay_s_;
    if (!covers(t)) continue;
    const Point p = at(t);
    const double weight = std::sqrt(bin.count) / noise.rate_rad_s;
    blocks[0].first = p.first;
    blocks[1].first = n + b.delays + (stretch_of.empty() ? 0 : stretch_of[j]);
    row.leftCols<order>() = scale_ * p.weights.d1.transpose();
    row(0, order) = -scale_ * p.curve.acceleration;
    row(0, order + 1) = p.curve.rate;
    row(0, order + 2) = 1;
    if (b.friction >= 0) row(0, order + 3) = scale_ * p.friction.rate;
    row *= weight;
    residual[0] = weight * (predicted(bin, p) - bin.rate_rad_s);
    system.accumulate_residual(blocks, row, residual);
  }
  add_prior(system);
  return system;
}

bool SplineModel::converge() {
  const Border b = border(1);
  const int n = knots_.control_points();
  for (int iteration = 0; iteration < 30; ++iteration) {
    const auto solution = normal_equations(b, {}).solve();
    if (!solution.ok()) return false;
    const Eigen::VectorXd& step = solution.step();
    points_ += step.head(n);
    // A first step may be long when scale and delay are poor: the delay never leaves the spline's margin at once.
    const double delay_step = std::clamp(step[n + b.delays], -0.5 * margin_s, 0.5 * margin_s);
    delay_s_ += delay_step;
    scale_ += step[n + b.scale];
    bias_ += step[n + b.bias];
    if (b.line_delay >= 0) line_delay_ += step[n + b.line_delay];
    if (b.friction >= 0) friction_strength_ += step[n + b.friction];
    if (std::abs(delay_s_ - task_.coarse.delay_s) > margin_s) return false;
    const double settled = 1e-3 * std::sqrt(solution.border_covariance()(b.delays, b.delays));
    if (std::abs(delay_step) < std::max(settled, 1e-12)) return true;
  }
  return false;
}

}  // namespace takt::pendulum
