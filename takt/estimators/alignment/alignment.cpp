// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/alignment.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "takt/estimators/alignment/correlation.h"
#include "takt/estimators/alignment/evidence.h"
#include "takt/estimators/alignment/excitation.h"
#include "takt/estimators/alignment/focal.h"
#include "takt/estimators/alignment/likelihood.h"
#include "takt/estimators/alignment/phase.h"
#include "takt/estimators/alignment/rivals.h"
#include "takt/estimators/alignment/tdicp.h"
#include "takt/estimators/alignment/verdict.h"

namespace takt {

using namespace alignment;

namespace {

constexpr std::size_t fewest_steps = 20;
/// Beyond this share of the turn, errors are not noise: the model does not fit.
constexpr double credible_relative_error = 0.05;
/// Rolling shutters take longer than this for a frame (s).
constexpr double fastest_readout_s = 3e-3;
/// How well it is known which row an apparent rotation stands for, as a share of the height.
constexpr double apparent_row_sigma = 0.03;
constexpr double rotation_known_rad = 0.035;
/// A correlation that is an answer by itself shares this much of the rotation.
constexpr double settled_share = 0.7;

Estimate blank(const RotationSignal& sensor, const ImuStream& reference, const char* method) {
  Estimate e;
  e.method = method;
  e.sensor = sensor.name;
  e.reference = reference.name;
  e.verdict = Verdict::trusted;
  return e;
}

/// Writes an internal (offset, centre) as stamps.
void set_offset(Estimate& e, const Problem& p, double offset_s, double sigma_s, double centre_s) {
  e.offset = p.between_epochs() + from_seconds(offset_s);
  e.sigma_s = sigma_s;
  e.epoch = p.sensor_epoch + from_seconds(centre_s);
}

Mat4 as_transform(const Mat3& rotation) {
  Mat4 t = Mat4::Identity();
  t.topLeftCorner<3, 3>() = rotation;
  return t;
}

Estimate correlation_estimate(const Problem& p, const Correlation& c, const Estimate& base) {
  Estimate e = base;
  e.method = "correlation";
  const double middle = 0.5 * (p.steps.front().t0 + p.steps.back().t1);
  set_offset(e, p, c.peaks.front().offset_s, c.peaks.front().sigma_s, middle);
  e.extras.push_back({"correlation", c.peaks.front().r, std::nullopt});
  return e;
}

Estimate phase_estimate(const Problem& p, const PhaseFit& f, const Coarse& start, const Estimate& base) {
  Estimate e = base;
  e.method = "phase";
  if (f.answered)
    set_offset(e, p, f.offset_s, f.sigma_s, start.centre_s);
  else
    e.doubt(Verdict::refused, "too few frequencies are coherent for a phase slope");
  return e;
}

/// Whether the readout is too close to none for any rolling shutter.
bool shows_no_readout(const LikelihoodFit& fit) {
  return std::abs(fit.readout_s) < 3 * fit.readout_sigma_s && fit.readout_sigma_s < 0.25 * fastest_readout_s;
}

LikelihoodFit fit_fine(const Problem& p, const Coarse& start, const AlignmentOptions& options, bool bearings) {
  const FrameTiming& timing = p.signal.timing;
  LikelihoodOptions wanted;
  wanted.bearings = bearings;
  wanted.log_focal = start.log_focal;
  const bool known = timing.readout_s != 0 || timing.shutter == Shutter::global;
  wanted.readout = bearings && (options.line_delay || !known || timing.readout_s != 0);
  wanted.readout_prior_s = wanted.readout_start_s = timing.readout_s;
  if (known && !options.line_delay) wanted.readout_prior_sigma_s = 0;
  LikelihoodFit fit = maximise_likelihood(p, start, wanted);
  const bool no_readout =
      wanted.readout && !options.line_delay && timing.shutter == Shutter::unknown && !known && shows_no_readout(fit);
  const bool no_drift = !options.drift && !(std::abs(fit.drift) > significant_sigmas * fit.drift_sigma);
  if (fit.converged && no_readout) {
    // What the data do not ask for is fixed at none: the offset then is not burdened with its uncertainty.
    Coarse again = start;
    again.offset_s = fit.offset_s, again.centre_s = fit.centre_s, again.drift = fit.drift;
    again.R_reference_sensor = fit.R_reference_sensor;
    wanted.readout = false, wanted.readout_prior_s = wanted.readout_start_s = 0;
    fit = maximise_likelihood(p, again, wanted);
  }
  // At the fit's centre the offset does not depend on the drift, so nothing has to be fitted anew without it.
  if (no_drift) fit.drift = 0;
  return fit;
}

void add_findings(Estimate& e, const Problem& p, const LikelihoodFit& f, const Coarse& start,
                  const AlignmentOptions& options) {
  e.drift = f.drift;
  e.drift_sigma = f.drift_sigma;
  if (!options.drift && f.drift != 0)
    e.reasons.push_back(fmt::format("the clocks drift by {:.1f} ± {:.1f} ppm, which is part of the answer",
                                    1e6 * f.drift, 1e6 * f.drift_sigma));
  if (f.rotation_sigma.maxCoeff() < rotation_known_rad)
    e.T_reference_sensor = as_transform(f.R_reference_sensor);
  else
    e.reasons.push_back("the motion is about one axis only: the rotation between the sensors is not known about it");
  const FrameTiming& timing = p.signal.timing;
  if (p.signal.source == "images" || p.signal.source == "tracks") {
    e.frame_instant = "middle";
    e.frame_row = timing.row == RowReference::first ? "first" : "middle";
    const int rows = timing.rows > 0 ? timing.rows : p.signal.model ? p.signal.model->height : 0;
    if (f.readout_s != 0 && rows > 0) {
      e.line_delay_s = f.readout_s / rows;
      if (f.readout_sigma_s > 0) e.line_delay_sigma_s = f.readout_sigma_s / rows;
      e.extras.push_back(
          {"readout_s", f.readout_s, f.readout_sigma_s > 0 ? std::optional(f.readout_sigma_s) : std::nullopt});
    } else {
      e.line_delay_s = 0;
    }
    if (start.log_focal != 0 && p.signal.model)
      e.extras.push_back({"focal_px", p.signal.model->fx * std::exp(start.log_focal), std::nullopt});
  }
  e.extras.push_back({"log_likelihood", f.log_likelihood, std::nullopt});
  e.extras.push_back({"explained", f.explained, std::nullopt});
  e.extras.push_back({"misfit", f.misfit, std::nullopt});
  e.extras.push_back({"relative_error", f.relative_error, std::nullopt});
  e.extras.push_back({"steps", static_cast<double>(f.used), std::nullopt});
  e.extras.push_back({"half_difference_s", f.halves[1].offset_s - f.halves[0].offset_s,
                      std::hypot(f.halves[0].sigma_s, f.halves[1].sigma_s)});
}

Estimate ml_estimate(const Problem& p, const LikelihoodFit& f, const Coarse& start, const Estimate& base,
                     const AlignmentOptions& options) {
  Estimate e = base;
  e.method = "ml";
  set_offset(e, p, f.offset_s, f.offset_sigma_s, f.centre_s);
  doubt_fit(e, p, f, start);
  if (e.answered()) add_findings(e, p, f, start, options);
  return e;
}

/// A fit that ends where the two rotations share little, though the correlation found them to share much, went astray.
bool went_astray(const LikelihoodFit& fit, const Correlation& c) {
  const double r = c.peaks.front().r;
  return !fit.converged || fit.explained < 0.5 * r * r;
}

/// Bearings know the translation apart from the rotation, and are believed where they fit; where they do not (few
/// points, a lens that is not known), the apparent rotations are surer.
bool prefer_bearings(const LikelihoodFit& rotation, const LikelihoodFit& bearings, const Correlation& c) {
  if (went_astray(bearings, c) || went_astray(rotation, c)) return !went_astray(bearings, c);
  return bearings.relative_error < credible_relative_error || bearings.relative_error < rotation.relative_error;
}

/// The readout by which rows are told apart (s): what the recording says, or what the bearings found where they are
/// believed, or where they leave no doubt that the shutter rolls.
double believed_readout_s(const FrameTiming& timing, const LikelihoodFit& bearings, bool bearings_win) {
  if (!bearings.converged) return timing.readout_s;
  const bool rolls = bearings.readout_s > std::max(fastest_readout_s, significant_sigmas * bearings.readout_sigma_s);
  return bearings_win || timing.shutter != Shutter::unknown || rolls ? bearings.readout_s : timing.readout_s;
}

/// A rolling shutter's frame has no single instant. Whoever takes it for one finds the offset of the row that its
/// apparent rotations stand for; `row` is the mean row of what was seen, in fractions of the height.
void refer_to_stamped_row(Estimate& e, double row, double readout_s, double readout_sigma_s) {
  if (!e.answered() || readout_s == 0) return;
  *e.offset -= from_seconds(row * readout_s);
  *e.sigma_s = std::hypot(*e.sigma_s, row * readout_sigma_s, apparent_row_sigma * readout_s);
}

/// The two likelihoods look at the same pictures in two ways, and err in two ways: one by noise, the other by a
/// translation that it takes for rotation. Where both fit and agree, the answer is their weighted mean, its sigma wider
/// by as much as they are apart (the Birge ratio). Where they disagree, translation explains it, and the bearings
/// stand.
void join(Estimate& answer, const Estimate& second, const LikelihoodFit& fine, const LikelihoodFit& other) {
  if (!answer.answered() || !second.answered()) return;
  if (std::max(fine.relative_error, other.relative_error) > credible_relative_error) return;
  const double apart = apart_s(answer, second);
  const double allowed = std::hypot(*answer.sigma_s, *second.sigma_s);
  if (std::abs(apart) > 3 * allowed) return;
  const double share = *answer.sigma_s * *answer.sigma_s / (allowed * allowed);
  *answer.offset += from_seconds(share * apart);
  *answer.sigma_s = *answer.sigma_s * *second.sigma_s / allowed * std::max(1.0, std::abs(apart) / allowed);
}

Estimate tdicp_estimate(const Problem& p, const Coarse& start, const Estimate& base) {
  Estimate e = base;
  e.method = "tdicp";
  const TdicpResult found = tdicp(p.signal, p.sensor_epoch, p.reference, start.offset_s, start.R_reference_sensor);
  if (found.converged) {
    set_offset(e, p, found.offset_s, found.sigma_s, start.centre_s);
    e.T_reference_sensor = as_transform(found.R_reference_sensor);
  } else {
    e.doubt(Verdict::refused, "the orientation curves could not be registered");
  }
  return e;
}

/// Where no fine fit settled, the correlation's answer is what there is, if the two share most of their rotation.
void fall_back(std::vector<Estimate>& all, const Correlation& c) {
  Estimate coarse = all.front();
  coarse.method = "ml";
  const double shared = std::pow(c.peaks.front().r, 2);
  if (shared < settled_share)
    coarse.doubt(Verdict::refused,
                 fmt::format("sensor and gyro disagree: at no offset do they share more than {:.0f} % "
                             "of the rotation, and no fine alignment settles",
                             100 * shared));
  else
    coarse.doubt(Verdict::weak, "the fine alignment did not settle: this is the correlation's answer");
  for (Estimate& e : all)
    if (e.method == "ml") e = coarse;
}

/// All that is fitted on the way to the answers.
struct Fits {
  Coarse start;
  PhaseFit phase;
  LikelihoodFit by_rotation, by_bearings;
  bool has_bearings = false, bearings_win = false;

  /// The likelihood that is the answer, and the other one.
  [[nodiscard]] const LikelihoodFit& fine() const { return bearings_win ? by_bearings : by_rotation; }
  [[nodiscard]] const LikelihoodFit& other() const { return bearings_win ? by_rotation : by_bearings; }
};

Fits fit_from(const Problem& p, const RateGrids& grids, const Correlation& c, const AlignmentOptions& options) {
  Fits f;
  f.start = follow_drift(p, grids, c);
  if (p.signal.focal_assumed) f.start.log_focal = fit_log_focal(p, f.start);
  f.phase = fit_phase(p, f.start);
  f.has_bearings = !p.pairs.empty();
  f.by_rotation = fit_fine(p, f.start, options, false);
  if (f.has_bearings) f.by_bearings = fit_fine(p, f.start, options, true);
  f.bearings_win = prefer_bearings(f.by_rotation, f.by_bearings, c);
  return f;
}

/// Adds the second likelihood, refers all answers to the same row, and holds the two likelihoods against each other.
void hear_second_likelihood(std::vector<Estimate>& all, const Problem& p, const Fits& f, const Estimate& base,
                            const AlignmentOptions& options) {
  Estimate second = ml_estimate(p, f.other(), f.start, base, options);
  second.method = f.bearings_win ? "ml-rotation" : "ml-bearings";
  const double readout_s = believed_readout_s(p.signal.timing, f.by_bearings, f.bearings_win);
  Estimate& answer = all.back();
  const Estimate* const knows_rows = f.bearings_win ? &answer : &second;
  const auto refer = [&](Estimate& e) {
    if (&e != knows_rows) refer_to_stamped_row(e, p.signal.apparent_row, readout_s, f.by_bearings.readout_sigma_s);
  };
  std::for_each(all.begin(), all.end(), refer);
  refer(second);
  hear_third_witness(answer, second, all.front(), f.bearings_win && f.fine().relative_error < credible_relative_error);
  join(answer, second, f.fine(), f.other());
  all.push_back(std::move(second));
}

/// What the likelihood found is held against methods that know less.
void confront_with_likelihood(std::vector<Estimate>& all, const LikelihoodFit& fine) {
  const Estimate& likelihood =
      *std::find_if(all.begin(), all.end(), [](const Estimate& e) { return e.method == "ml"; });
  for (Estimate& e : all) {
    if (e.method.starts_with("ml")) continue;
    if (fine.converged && fine.drift != 0 && e.answered())
      e.doubt(Verdict::weak, fmt::format("the clocks drift by {:.1f} ± {:.1f} ppm, which this method does not model",
                                         1e6 * fine.drift, 1e6 * fine.drift_sigma));
    confront(e, likelihood);
  }
}

std::vector<Estimate> every_answer(const Problem& p, const Correlation& c, const Fits& f, const Estimate& base,
                                   const AlignmentOptions& options) {
  std::vector<Estimate> all{correlation_estimate(p, c, base), phase_estimate(p, f.phase, f.start, base),
                            tdicp_estimate(p, f.start, base), ml_estimate(p, f.fine(), f.start, base, options)};
  if (f.has_bearings) hear_second_likelihood(all, p, f, base, options);
  if (went_astray(f.fine(), c)) fall_back(all, c);
  confront_with_likelihood(all, f.fine());
  return all;
}

std::vector<Panel> panels(const Problem& p, const Correlation& c, const Fits& f) {
  const LikelihoodFit& fine = f.fine();
  const double offset = fine.converged ? fine.offset_s : f.start.offset_s;
  const double drift = fine.converged ? fine.drift : f.start.drift;
  const double centre = fine.converged ? fine.centre_s : f.start.centre_s;
  const Mat3 R = fine.converged ? fine.R_reference_sensor : f.start.R_reference_sensor;
  return {rates_panel(p, offset, drift, centre, R, false),
          rates_panel(p, offset, drift, centre, R, true),
          correlation_panel(p, c),
          windows_panel(fine),
          residuals_panel(fine),
          coherence_panel(f.phase)};
}

/// The method asked for.
const Estimate& chosen(const std::vector<Estimate>& all, const std::string& method) {
  const std::string wanted = method == "auto" ? "ml" : method;
  for (const Estimate& e : all)
    if (e.method == wanted) return e;
  throw std::invalid_argument("align_rotation: no method is called " + method);
}

void check(const ImuStream& reference) {
  if (reference.stamps.size() != reference.gyro_rad_s.size())
    throw std::invalid_argument(
        fmt::format("align_rotation: {} stamps for {} rates", reference.stamps.size(), reference.gyro_rad_s.size()));
}

/// Why there is too little to begin with; empty where there is enough.
std::string too_little(const RotationSignal& sensor, const ImuStream& reference) {
  if (sensor.increments.size() < fewest_steps)
    return fmt::format("only {} rotations of the sensor were measured; {} is the least that can be aligned",
                       sensor.increments.size(), fewest_steps);
  if (reference.size() < fewest_steps)
    return fmt::format("only {} samples of the reference; {} is the least", reference.size(), fewest_steps);
  return "";
}

Correlation search(const Problem& p, const RateGrids& grids, const AlignmentOptions& options) {
  const double between = to_seconds(p.between_epochs());
  const double half_width = options.search_s.value_or(std::numeric_limits<double>::infinity());
  Correlation found = correlate(p, grids, -half_width - between, half_width - between);
  settle_rivals(p, found);
  return found;
}

}  // namespace

Estimate align_rotation(const RotationSignal& sensor, const ImuStream& reference, const AlignmentOptions& options) {
  check(reference);
  const Estimate base = blank(sensor, reference, "ml");
  const auto refuse = [&](const std::string& why) {
    Estimate e = base;
    e.doubt(Verdict::refused, why);
    return e;
  };
  if (const std::string why = too_little(sensor, reference); !why.empty()) return refuse(why);
  const Problem problem(sensor, reference);
  if (problem.steps.size() < fewest_steps)
    return refuse(fmt::format("only {} of the sensor's {} rotations could be measured", problem.steps.size(),
                              sensor.increments.size()));

  const RateGrids grids = rate_grids(problem);
  const Correlation coarse = search(problem, grids, options);
  if (const auto why = no_answer(measure_excitation(problem), coarse, problem)) {
    Estimate e = refuse(*why);
    if (!coarse.curve_r.empty()) e.evidence.panels.push_back(correlation_panel(problem, coarse));
    return e;
  }
  const Fits fits = fit_from(problem, grids, coarse, options);
  std::vector<Estimate> all = every_answer(problem, coarse, fits, base, options);
  Estimate answer = chosen(all, options.method);
  answer.evidence.panels = panels(problem, coarse, fits);
  answer.estimates = std::move(all);
  return answer;
}

}  // namespace takt
