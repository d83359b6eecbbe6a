// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/joint_spline.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "takt/estimators/pendulum/spline_model.h"
#include "takt/math/long_run_variance.h"
#include "takt/math/median.h"

namespace takt::pendulum {
namespace {

constexpr const char* not_converging =
    "the joint fit of angle and rate does not converge: were frames or samples lost while their stamps went on, "
    "or are the streams' stamps seconds apart?";

double robust_sigma(std::vector<double> v) {
  for (double& x : v) x = std::abs(x);
  return 1.4826 * median(std::move(v));
}

double lag_one_correlation(const std::vector<double>& r) {
  double squares = 0, products = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    squares += r[i] * r[i];
    if (i > 0) products += r[i] * r[i - 1];
  }
  return squares > 0 ? products / squares : 0;
}

SplineData gather(const Signals& s, const SplineTask& task) {
  SplineData d;
  for (std::size_t i = 0; i < s.angle_time_s.size(); ++i)
    if (s.angle_time_s[i] >= task.from_s && s.angle_time_s[i] <= task.to_s)
      d.angles.push_back({s.angle_time_s[i], s.angle_rad[i], s.row[i]});
  for (std::size_t j = 0; j < s.rate_time_s.size(); ++j) {
    const double t = s.rate_time_s[j] - task.coarse.delay_s;
    if (t >= task.from_s && t <= task.to_s) d.rates.push_back({s.rate_time_s[j], s.rate_rad_s[j]});
  }
  return d;
}

/// Of the data against the model as it stands.
struct Residuals {
  std::vector<double> angle, rate;
};
Residuals residuals(const SplineData& data, const SplineModel& model) {
  return {model.angle_residuals(data), model.rate_residuals(data)};
}

/// Keeps what lies within `limit`; returns how many do not.
template <class Reading>
std::size_t keep_within(double limit, std::vector<Reading>& readings, std::vector<double>& residual) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < residual.size(); ++i) {
    if (std::abs(residual[i]) > limit) continue;
    readings[kept] = readings[i];
    residual[kept++] = residual[i];
  }
  const std::size_t dropped = residual.size() - kept;
  readings.resize(kept);
  residual.resize(kept);
  return dropped;
}

/// Drops what lies beyond 5 (angles) or 6 (the many more rates) robust standard deviations.
bool drop_outliers(SplineData& data, Residuals& r, SplineFit& fit) {
  const std::size_t angles = keep_within(5 * robust_sigma(r.angle), data.angles, r.angle),
                    rates = keep_within(6 * robust_sigma(r.rate), data.rates, r.rate);
  fit.dropped_angles += angles;
  fit.dropped_rates += rates;
  return angles + rates > 0;
}

/// Noise levels from the residuals, each over the degrees of freedom that the spline has left it.
void estimate_noise(const Residuals& r, SplineModel& model) {
  const SplineModel::Leverage used = model.leverage();
  double squares = 0;
  for (const double a : r.angle) squares += a * a;
  const double left = std::max(1.0, static_cast<double>(r.angle.size()) - used.angles);
  model.noise.angle_rad = std::max(std::sqrt(squares / left), 1e-10);
  // Lags of up to 20 ms: longer than any low-pass in a gyro that is fit for this, shorter than the knots' interval.
  const int lags = std::clamp(static_cast<int>(0.02 / model.rate_interval_s()), 2, 12);
  const double variance = long_run_variance(r.rate, lags, used.rates);
  model.noise.rate_rad_s = std::max(std::sqrt(variance), 1e-9);
}

/// Correlation from one bin of rates to the next that the gyro's own low-pass makes, whatever the motion: of their
/// sixth differences, in which a swing leaves nothing, white noise has −6/7, and each step of it the weights 1, 12, 66,
/// …
double correlation_of_noise(const std::vector<RateBin>& bins) {
  constexpr std::array<double, 7> binomial{1, -6, 15, -20, 15, -6, 1};
  std::vector<double> differences;
  for (std::size_t i = 0; i + binomial.size() <= bins.size(); ++i) {
    double d = 0;
    for (std::size_t k = 0; k < binomial.size(); ++k) d += binomial[k] * bins[i + k].rate_rad_s;
    differences.push_back(d);
  }
  const double ratio = lag_one_correlation(differences);
  return (924 * ratio + 792) / (1419 + 1584 * ratio);
}

/// Positive correlation from one residual to the next means that the knots are too far apart for the motion. Noise
/// through the gyro's own low-pass correlates neighbouring bins too, hence its looser limit.
bool follows_the_motion(const std::vector<double>& angle_residuals, const SplineModel& model) {
  const double limit = 0.05 + 4 / std::sqrt(static_cast<double>(angle_residuals.size()));
  return lag_one_correlation(angle_residuals) < limit && lag_one_correlation(model.binned_rate_residuals()) <
                                                             std::max(0.25, correlation_of_noise(model.bins())) + limit;
}

void tell_stretches(const SplineModel& model, const SplineTask& task, SplineFit& fit) {
  const auto found = model.stretch_delays(task.cuts_s);
  if (!found) return;
  fit.stretches = found->delays;
  fit.scatter = found->scatter;
  fit.scatter_dof = found->dof;
  fit.scatter_about_drift = found->scatter_about_drift;
  fit.epoch_s = found->epoch_s;
  fit.drift = found->drift;
  fit.drift_sigma = found->drift_sigma;
}

void tell_residuals(const SplineData& data, const SplineModel& model, SplineFit& fit) {
  fit.angle_residual_rad = model.angle_residuals(data);
  for (const auto& a : data.angles) {
    fit.angle_time_s.push_back(a.time_s);
    fit.angle_rad.push_back(a.angle_rad);
  }
  fit.rate_residual_rad_s = model.binned_rate_residuals();
  for (const auto& b : model.bins()) {
    fit.rate_time_s.push_back(b.time_s);
    fit.rate_rad_s.push_back(b.rate_rad_s);
  }
}

}  // namespace

SplineFit fit_joint_spline(const Signals& signals, const SplineTask& task) {
  SplineFit fit;
  SplineData data = gather(signals, task);
  fit.angles = data.angles.size();
  fit.rates = data.rates.size();
  if (data.angles.size() < 30 || data.rates.size() < 30) {
    fit.failure = "fewer than 30 angles or rates in the window";
    return fit;
  }

  double knots = task.period_s / 12;
  SplineModel model(task, knots, signals.frame_interval_s, signals.rate_interval_s);
  for (;; knots /= 2) {
    model = SplineModel(task, knots, signals.frame_interval_s, signals.rate_interval_s);
    if (!model.start(data)) {
      fit.failure = "the angles do not determine the motion";
      return fit;
    }
    Residuals left;
    for (int pass = 0; pass < 4; ++pass) {
      if (!model.converge()) {
        fit.failure = not_converging;
        return fit;
      }
      left = residuals(data, model);
      if (drop_outliers(data, left, fit)) model.take(data);
      estimate_noise(left, model);
    }
    if (follows_the_motion(left.angle, model) || knots < 3 * signals.frame_interval_s) break;
  }
  if (!model.converge()) {
    fit.failure = not_converging;
    return fit;
  }

  const SplineModel::Answer answer = model.answer();
  fit.delay_s = answer.delay_s;
  fit.delay_sigma_s = answer.delay_sigma_s;
  fit.scale = answer.scale;
  fit.scale_sigma = answer.scale_sigma;
  fit.bias_rad_s = answer.bias_rad_s;
  fit.line_delay_s = answer.line_delay_s;
  fit.line_delay_sigma_s = answer.line_delay_sigma_s;
  fit.dry_friction_rad_s2 = answer.dry_friction;
  fit.dry_friction_sigma = answer.dry_friction_sigma;
  fit.angle_sigma_rad = model.noise.angle_rad;
  fit.rate_density = model.noise.rate_rad_s * std::sqrt(signals.rate_interval_s);
  fit.knot_interval_s = knots;
  fit.knots_halved = knots < task.period_s / 12;
  fit.epoch_s = 0.5 * (task.from_s + task.to_s);
  tell_stretches(model, task, fit);
  tell_residuals(data, model, fit);
  return fit;
}

}  // namespace takt::pendulum
