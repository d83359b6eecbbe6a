// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/likelihood.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "takt/estimators/alignment/expectations.h"
#include "takt/estimators/alignment/inflation.h"
#include "takt/estimators/alignment/step_model.h"
#include "takt/math/median.h"

namespace takt::alignment {

namespace {

/// How far the sensor's rotation may be from the gyro's by a linear map beside a rotation: scale and misalignment of a
/// gyro, an inexact focal length, a translation that goes with the rotation. Over a short recording such an error would
/// pass for an offset; held this loosely it widens the uncertainty instead.
constexpr double gain_sigma = 0.03;
/// Crystals differ by tens of ppm, cheap resonators by hundreds. What misfits for a while (depths, a lens) passes for
/// more over a short recording.
constexpr double drift_sigma = 1.5e-4;
/// Even a readout from a data sheet is not known better than to this share of it.
constexpr double readout_known_to = 2e-3;
/// While a frame is read the camera moves on; what of that goes with the turning passes for readout. The curve of its
/// way takes it off, but for this share.
constexpr double way_known_to = 0.25;
constexpr double outlier_sigmas = 4;
struct Normals {
  Normal h = Normal::Zero();
  State g = State::Zero();
  double squares = 0;  ///< of the whitened, weighted residuals
  double rows = 0;     ///< weighted count of them
};

/// Rms size of the residuals in claimed sigmas, by the median (χ²(3) has median 2.366).
double residual_scale(const std::vector<Linear>& all) {
  std::vector<double> m;
  for (const Linear& l : all)
    if (l.used) m.push_back((l.root * l.rows.col(unknowns)).squaredNorm());
  if (m.empty()) return 1;
  return std::max(1e-9, std::sqrt(median(std::move(m)) / 2.366));
}

/// Visits every used step with its rows whitened in itself (claimed covariance), robustly weighted and whitened in
/// time.
template <class Visit>
void for_each_whitened(const std::vector<Linear>& all, const Arma11& errors, double scale, Visit&& visit) {
  Whitener<Rows> whiten(errors);
  bool broken = true;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Linear& l = all[i];
    if (!l.used) {
      broken = true;
      continue;
    }
    Rows rows = l.root * l.rows;
    const double misfit = rows.col(unknowns).norm() / (scale * std::sqrt(3.0));
    const double w = weight_of(misfit);
    rows *= std::sqrt(w);
    if (broken || l.first) whiten.restart();
    broken = false;
    visit(i, l, w, whiten(rows));
  }
}

Normals accumulate(const std::vector<Linear>& all, const Arma11& errors, double scale) {
  Normals n;
  for_each_whitened(all, errors, scale, [&](std::size_t, const Linear& l, double w, const Rows& rows) {
    const auto j = rows.leftCols<unknowns>();
    n.h.noalias() += j.transpose() * j;
    n.g.noalias() += j.transpose() * rows.col(unknowns);
    n.h(readout, readout) += w * l.readout_information;
    n.g[readout] += w * l.readout_gradient;
    n.squares += rows.col(unknowns).squaredNorm();
    n.rows += 3 * w;
  });
  return n;
}

/// Holds what is not asked for, lends a little stiffness to what the motion may not show (the rotation about the only
/// axis turned about), and pulls drift and gain towards none. `s2` is the variance that the normals take for one.
void add_priors(Normals& n, const LikelihoodOptions& options, const Parameters& x, double readout_sigma, double s2) {
  const double hold = 1e30;
  for (int k = 0; k < 3; ++k) n.h(rotation + k, rotation + k) += s2, n.h(bias + k, bias + k) += s2;
  const double drift_stiffness = s2 / (drift_sigma * drift_sigma);
  n.h(drift, drift) += options.drift ? drift_stiffness : hold;
  if (options.drift) n.g[drift] -= drift_stiffness * x.drift;
  const double readout_stiffness = s2 / (readout_sigma * readout_sigma);
  n.h(readout, readout) += options.readout ? readout_stiffness : hold;
  if (options.readout) n.g[readout] -= readout_stiffness * (x.readout_s - options.readout_prior_s);
  const double stiffness = s2 / (gain_sigma * gain_sigma);
  const double now[6] = {x.gain(0, 0), x.gain(1, 1), x.gain(2, 2), x.gain(0, 1), x.gain(0, 2), x.gain(1, 2)};
  for (int k = 0; k < 6; ++k) {
    n.h(gain + k, gain + k) += stiffness;
    n.g[gain + k] -= stiffness * now[k];
  }
}

Arma11 measure_correlation(const std::vector<Linear>& all, double scale) {
  std::vector<std::vector<double>> stretches;
  std::size_t kept = 0;
  std::array<std::vector<double>, 3> current;
  const auto flush = [&] {
    for (auto& axis : current)
      if (axis.size() > 1) stretches.push_back(std::move(axis));
    current = {};
  };
  for (const Linear& l : all) {
    if (!l.used || l.first) flush();
    if (!l.used) continue;
    const Vec3 u = l.root * l.rows.col(unknowns) / scale;
    const double w = std::sqrt(weight_of(u.norm() / std::sqrt(3.0)));
    for (int k = 0; k < 3; ++k) current[static_cast<std::size_t>(k)].push_back(w * u[k]);
    // Some thousand steps fix two parameters to a few percent.
    if (++kept > 3000) break;
  }
  flush();
  return fit_arma11(stretches);
}

void step_by(Parameters& x, const State& dx) {
  x.offset_s += dx[offset];
  x.drift += dx[drift];
  x.R_reference_sensor = x.R_reference_sensor * exp_so3(dx.segment<3>(rotation)).toRotationMatrix();
  x.bias += dx.segment<3>(bias);
  const auto g = dx.segment<6>(gain);
  Mat3 more;
  more << g[0], g[3], g[4], g[3], g[1], g[5], g[4], g[5], g[2];
  x.gain += more;
  x.readout_s += dx[readout];
}

/// No step may leave the neighbourhood in which the linearisation means something.
State limited(State dx, double lobe_s) {
  double shrink = 1;
  const auto limit = [&](double value, double most) {
    if (std::abs(value) > most) shrink = std::min(shrink, most / std::abs(value));
  };
  limit(dx[offset], 0.5 * lobe_s);
  limit(dx.segment<3>(rotation).norm(), 0.3);
  limit(dx[readout], 0.02);
  limit(dx.segment<6>(gain).cwiseAbs().maxCoeff(), 0.1);
  return shrink * dx;
}

/// Of the rotation errors as a Student t, by which wild ones count for a little and not for nothing; comparable between
/// fits to the same pictures.
double heavy_tailed_likelihood(const std::vector<Linear>& all) {
  std::vector<double> squares;
  for (const Linear& l : all)
    if (l.used) squares.push_back(l.rows.col(unknowns).squaredNorm());
  if (squares.empty()) return 0;
  constexpr double freedom = 3;
  const double variance = std::max(1e-16, median(squares) / 2.366);
  double sum = 0;
  for (const double s : squares)
    sum -= 0.5 * (freedom + 3) * std::log1p(s / (freedom * variance)) + 1.5 * std::log(variance);
  return sum;
}

/// Share of the sensor's rotation that the prediction explains, and the outliers' share.
void judge(const std::vector<Linear>& all, double scale, LikelihoodFit& fit) {
  double squares = 0, total = 0, n = 0, outliers = 0;
  Vec3 mean = Vec3::Zero();
  for (const Linear& l : all)
    if (l.used) mean += l.predicted, n += 1;
  if (n == 0) return;
  mean /= n;
  for (const Linear& l : all) {
    if (!l.used) continue;
    const Vec3 residual = l.rows.col(unknowns);
    const double misfit = (l.root * residual).norm() / (scale * std::sqrt(3.0));
    if (misfit > outlier_sigmas) {
      outliers += 1;
      continue;
    }
    squares += residual.squaredNorm();
    total += (l.predicted + residual - mean).squaredNorm();
  }
  fit.used = static_cast<std::size_t>(n);
  fit.outliers = outliers / n;
  fit.explained = total > 0 ? 1 - squares / total : 0;
}

/// Offset alone from the items whose middle lies in [from, to), everything else held.
WindowOffset window_offset(const std::vector<Rows>& whitened, const std::vector<Item>& items, double from, double to,
                           double s2) {
  double h = 0, g = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double middle = 0.5 * (items[i].t0 + items[i].t1);
    if (middle < from || middle >= to) continue;
    h += whitened[i].col(offset).squaredNorm();
    g += whitened[i].col(offset).dot(whitened[i].col(unknowns));
  }
  const double t = 0.5 * (from + to);
  return h > 0 ? WindowOffset{t, g / h, std::sqrt(s2 / h)} : WindowOffset{t, 0, 0};
}

void keep_residuals(const std::vector<Item>& items, const std::vector<Linear>& all, LikelihoodFit& fit) {
  const std::size_t stride = std::max<std::size_t>(1, all.size() / 1500);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < all.size(); i += stride)
    if (all[i].used) kept.push_back(i);
  std::sort(kept.begin(), kept.end(), [&](std::size_t a, std::size_t b) { return items[a].t0 < items[b].t0; });
  for (const std::size_t i : kept) {
    fit.residual_t_s.push_back(0.5 * (items[i].t0 + items[i].t1));
    fit.residual_rad.push_back(all[i].rows.col(unknowns));
  }
}

/// As if the unknown had been measured with that much more noise: what goes with it is less certain too.
void add_noise(Normal& covariance, Unknown unknown, double variance) {
  const State with = covariance.col(unknown) / covariance(unknown, unknown);
  covariance += variance * with * with.transpose();
}

/// An unknown whose own errors last longer than the offset's, by a factor of σ.
void widen(Normal& covariance, Unknown unknown, double factor) {
  if (factor > 1) add_noise(covariance, unknown, (factor * factor - 1) * covariance(unknown, unknown));
}

}  // namespace

LikelihoodFit maximise_likelihood(const Problem& problem, const Coarse& start, const LikelihoodOptions& options) {
  LikelihoodFit fit;
  StepModel model(problem, options);
  Items items(problem, options.bearings);
  Parameters x{start.offset_s, start.drift,  start.centre_s,         start.R_reference_sensor,
               Vec3::Zero(),   Mat3::Zero(), options.readout_start_s};
  Arma11 errors;
  double scale = 1, relative = 0;
  std::vector<Linear> all;
  Normals n;
  LikelihoodOptions held = options;
  const bool readout_known = options.readout_prior_sigma_s == 0;
  double with_turn = 0;
  const auto learn_way = [&](const std::vector<Linear>& steps) {
    with_turn = parallax_with_turn(steps);
    model.expect_way(items.way(steps));
  };
  const auto readout_tolerance = [&] { return std::hypot(way_known_to * with_turn, readout_known_to) * x.readout_s; };
  const auto readout_sigma = [&] {
    return readout_known ? std::max(1e-6, std::abs(readout_tolerance())) : options.readout_prior_sigma_s;
  };

  // A long recording settles on a part of it first; the whole then takes one or two steps.
  std::size_t stride = std::max<std::size_t>(1, items.all().size() / 6000);
  constexpr int most = 80;
  for (fit.iterations = 0; fit.iterations < most; ++fit.iterations) {
    // The readout joins once the offset has settled: far from it it would chase its error.
    held.readout = options.readout && fit.iterations >= (readout_known ? 8 : 5);
    if (options.bearings && (fit.iterations == 2 || fit.iterations == 4)) model.remove_bias(x.bias);
    // A second time where the readout, which joins late, was not yet there the first time.
    if (options.bearings && (fit.iterations == 6 || (options.readout && fit.iterations == 10))) {
      if (options.readout) learn_way(items.linearise(model, x, stride));
      items.settle(model, x, stride);
    }
    all = items.linearise(model, x, stride);
    // What is expected of the recording is measured once the bias and the rotation are about right, then kept.
    if (fit.iterations >= 3 && fit.iterations < 6) {
      if (options.bearings) {
        model.expect_parallax(expected_parallax(all));
        learn_way(all);
      }
      relative = relative_variance(all, residual_scale(all), relative);
      model.expect_relative_error(relative);
      all = items.linearise(model, x, stride);
    }
    // Medians and measured correlations move a little with every step and may go round in circles: kept in the end.
    if (fit.iterations < 30) scale = residual_scale(all);
    if (fit.iterations >= 5 && fit.iterations < 30) errors = measure_correlation(all, scale);
    n = accumulate(all, errors, scale);
    if (n.rows < 30) return fit;
    const double s2 = n.squares / std::max(1.0, n.rows - double{unknowns});
    add_priors(n, held, x, readout_sigma(), s2);
    const State dx = limited(n.h.ldlt().solve(n.g), start.lobe_s);
    if (!dx.allFinite()) return fit;
    step_by(x, dx);
    const Normal covariance = n.h.inverse() * s2;
    const double sigma = std::sqrt(std::max(0.0, covariance(offset, offset)));
    // The rotation about an axis that the motion does not show may wander for ever: in the end the offset alone counts.
    const bool all_rest = dx.dot(n.h * dx) < 0.2 * s2 || fit.iterations > 24;
    const bool settled = all_rest && std::abs(dx[offset]) < 0.05 * sigma;
    if (!settled || fit.iterations < (options.readout ? 12 : 8)) continue;
    if (stride == 1) {
      fit.converged = true;
      break;
    }
    stride = 1;
    if (options.bearings) items.settle(model, x, stride);
  }

  // The last linearisation is at the solution (or next to it): everything that is said of it comes from there.
  all = items.linearise(model, x, 1);
  scale = residual_scale(all);
  n = accumulate(all, errors, scale);
  const double s2 = n.squares / std::max(1.0, n.rows - double{unknowns});
  add_priors(n, options, x, readout_sigma(), s2);
  const Normal shape = n.h.inverse();
  std::vector<Rows> whitened(all.size(), Rows::Zero());
  for_each_whitened(all, errors, scale,
                    [&](std::size_t i, const Linear&, double, const Rows& rows) { whitened[i] = rows; });
  Normal covariance = s2 * shape;
  const Scores scores{items.all(), all, whitened, errors, scale, items.overlap()};
  const auto by_match = options.bearings ? items.by_match(model, x) : std::vector<Eigen::Matrix3Xd>(all.size());
  const auto remembered_by = [&](Unknown unknown) {
    return std::max(inflation_by_time(scores, shape, unknown),
                    inflation_by_feature(scores, by_match, shape, unknown, s2));
  };
  const double remembered = remembered_by(offset);
  const double begin = problem.steps.front().t0, length = problem.steps.back().t1 - begin;
  const auto piece = [&](double k, double of, double inflation) {
    return window_offset(whitened, items.all(), begin + k / of * length, begin + (k + 1) / of * length,
                         s2 * inflation * inflation);
  };
  const double windows = std::clamp(std::floor(static_cast<double>(items.all().size()) / 60), 2.0, 24.0);
  for (double w = 0; w < windows; ++w) fit.windows.push_back(piece(w, windows, remembered));
  fit.halves[0] = piece(0, 2, remembered);
  fit.halves[1] = piece(1, 2, remembered);
  const double scatter = inflation_by_window(fit.windows), widened = remembered * scatter;
  fit.inflation = inflation_by_time(scores, shape, offset) * scatter;
  covariance *= widened * widened;
  if (options.drift) widen(covariance, drift, remembered_by(drift) / remembered);
  if (options.readout && !readout_known) {
    widen(covariance, readout, remembered_by(readout) / widened);
    add_noise(covariance, readout, std::pow(readout_tolerance(), 2));
  }

  judge(all, scale, fit);
  fit.log_likelihood = heavy_tailed_likelihood(all) / items.overlap();
  keep_residuals(items.all(), all, fit);
  fit.errors = errors;
  fit.misfit = scale;
  fit.relative_error = std::sqrt(relative);
  // The centre moves to where offset and drift are uncorrelated: there the offset is known best.
  const double move = options.drift ? -covariance(offset, drift) / covariance(drift, drift) : 0;
  fit.centre_s = x.centre_s + move;
  fit.offset_s = x.offset_s + move * x.drift;
  fit.offset_sigma_s = std::sqrt(std::max(0.0, covariance(offset, offset) + move * covariance(offset, drift)));
  fit.drift = x.drift;
  fit.drift_sigma = options.drift ? std::sqrt(covariance(drift, drift)) : 0;
  fit.R_reference_sensor = x.R_reference_sensor;
  fit.gyro_bias = x.bias;
  fit.rotation_sigma =
      (x.R_reference_sensor * covariance.block<3, 3>(rotation, rotation) * x.R_reference_sensor.transpose())
          .diagonal()
          .cwiseSqrt();
  fit.readout_s = readout_known || !options.readout ? options.readout_prior_s : x.readout_s;
  fit.readout_sigma_s = options.readout && !readout_known ? std::sqrt(covariance(readout, readout)) : 0;

  return fit;
}

}  // namespace takt::alignment
