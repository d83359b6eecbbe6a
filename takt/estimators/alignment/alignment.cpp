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
#include "takt/estimators/alignment/tdicp.h"

namespace takt {

using namespace alignment;

namespace {

constexpr std::size_t fewest_steps = 20;
/// The rival must explain the data worse by this much (nats): e¹² to one.
constexpr double clear_margin = 12;
/// Below this share of common rotation, with both sides sure of themselves, they do not see the same motion.
constexpr double disagreement = 0.4, doubtful_agreement = 0.85;
/// "Sure of themselves": they misfit beyond their claims, in general or in proportion to the turn.
constexpr double claimed_misfit = 3, relative_misfit = 0.15;
/// Beyond this share of the turn, errors are not noise: the model does not fit.
constexpr double credible_relative_error = 0.1;
/// A shorter readout than this is a global shutter's (s).
constexpr double shortest_readout_s = 1e-3;
/// A motion this far above the noise must correlate, if it is the same.
constexpr double strong_motion = 5, least_correlation = 0.5, unrivalled_correlation = 0.85;
constexpr double significant_sigmas = 4;
constexpr double rotation_known_rad = 0.035;
constexpr double plausible_drift = 5e-4;

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
  set_offset(e, p, c.peaks.front().offset_s, c.sigma_s, middle);
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

/// Reasons not to answer at all, found before any fine estimate.
std::optional<std::string> no_answer(const Excitation& x, const Correlation& c, const Problem& p) {
  if (x.sensor_still())
    return fmt::format("the sensor hardly turns: {:.4f} rad/s against {:.4f} rad/s of noise; rotate it about two axes",
                       x.sensor_rms[0], x.sensor_noise);
  if (x.reference_still())
    return fmt::format("the reference hardly turns: {:.4f} rad/s against {:.4f} rad/s of noise", x.reference_rms[0],
                       x.reference_noise);
  if (!c.refusal.empty()) return c.refusal;
  const double base = to_seconds(p.between_epochs());
  const bool strong =
      x.sensor_rms[0] > strong_motion * x.sensor_noise && x.reference_rms[0] > strong_motion * x.reference_noise;
  const bool rivalled = c.rival_margin < clear_margin;
  if (strong && c.peaks.front().r < (rivalled ? unrivalled_correlation : least_correlation))
    return fmt::format(
        "sensor and gyro disagree: at no offset do they share more than {:.0f} % of the rotation; is the "
        "picture stabilised in the camera, or are the two not rigidly joined or not of the same time?",
        100 * c.peaks.front().r * c.peaks.front().r);
  if (c.peaks.front().evidence < c.significance)
    return fmt::format(
        "no offset between {:.3f} and {:.3f} s stands out: the best correlation is {:.2f}, as chance gives too",
        c.searched_from_s + base, c.searched_to_s + base, c.peaks.front().r);
  if (rivalled)
    return fmt::format(
        "two offsets fit about equally well, {:.4f} and {:.4f} s: the motion repeats itself; move less "
        "regularly, or narrow the search",
        c.peaks[0].offset_s + base, c.peaks[1].offset_s + base);
  return std::nullopt;
}

LikelihoodFit fit_fine(const Problem& p, const Coarse& start, const AlignmentOptions& options, bool bearings) {
  const FrameTiming& timing = p.signal.timing;
  LikelihoodOptions wanted;
  wanted.bearings = bearings;
  wanted.log_focal = start.log_focal;
  // A readout that the recording knows is used as it is.
  const bool readout_known = timing.shutter == Shutter::global || timing.readout_s > 0;
  wanted.readout = bearings && (options.line_delay || !readout_known);
  LikelihoodFit fit = maximise_likelihood(p, start, wanted, timing.readout_s);
  const bool free_readout = wanted.readout && !options.line_delay && timing.shutter == Shutter::unknown;
  const bool no_readout =
      free_readout && !(fit.readout_s > std::max(shortest_readout_s, significant_sigmas * fit.readout_sigma_s));
  const bool no_drift = !options.drift && !(std::abs(fit.drift) > significant_sigmas * fit.drift_sigma);
  if (!fit.converged || (!no_readout && !no_drift)) return fit;
  // What the data do not ask for is fixed at none: the offset then is not burdened with its uncertainty.
  const double drift_sigma = fit.drift_sigma;
  Coarse again = start;
  again.offset_s = fit.offset_s, again.centre_s = fit.centre_s;
  again.drift = no_drift ? 0 : fit.drift;
  again.R_reference_sensor = fit.R_reference_sensor;
  wanted.drift = !no_drift;
  wanted.readout = wanted.readout && !no_readout;
  fit = maximise_likelihood(p, again, wanted, wanted.readout ? fit.readout_s : timing.readout_s);
  if (no_drift) fit.drift = 0, fit.drift_sigma = drift_sigma;
  return fit;
}

void doubt_fit(Estimate& e, const Problem& p, const LikelihoodFit& f, const Coarse& start) {
  if (!f.converged) {
    e.doubt(Verdict::refused, "the fine alignment did not settle");
    return;
  }
  const double moved = f.offset_s - start.offset_s - start.drift * (f.centre_s - start.centre_s);
  if (std::abs(moved) > 2 * start.lobe_s + 0.02) {
    e.doubt(Verdict::refused, fmt::format("the fine alignment left the correlation peak by {:.1f} ms", 1e3 * moved));
    return;
  }
  const bool sure = f.misfit > claimed_misfit || f.relative_error > relative_misfit;
  if (f.explained < disagreement && sure)
    e.doubt(Verdict::refused,
            fmt::format("sensor and gyro disagree: they share only {:.0f} % of the rotation; is the picture stabilised "
                        "in the camera, or are the two not rigidly joined?",
                        100 * std::max(0.0, f.explained)));
  else if (f.explained < doubtful_agreement && sure)
    e.doubt(Verdict::weak, fmt::format("sensor and gyro share only {:.0f} % of the rotation", 100 * f.explained));
  if (!e.answered()) return;
  const double apart = f.halves[1].offset_s - f.halves[0].offset_s;
  const double apart_sigma = std::hypot(f.halves[0].sigma_s, f.halves[1].sigma_s);
  if (f.halves[0].sigma_s > 0 && f.halves[1].sigma_s > 0 && std::abs(apart) > significant_sigmas * apart_sigma)
    e.doubt(Verdict::weak, fmt::format("the two halves disagree by {:.3f} ms, {:.1f} times the uncertainty of that",
                                       1e3 * apart, std::abs(apart) / apart_sigma));
  if (f.relative_error > relative_misfit)
    e.doubt(Verdict::weak,
            fmt::format("errors of {:.0f} % of the turn: the lens is not known well enough (--intrinsics), or "
                        "much of the motion is translation",
                        100 * f.relative_error));
  if (std::abs(f.drift) > plausible_drift)
    e.doubt(Verdict::weak, fmt::format("a drift of {:.0f} ppm is more than two crystals can differ by", 1e6 * f.drift));
  if (f.outliers > 0.2)
    e.doubt(Verdict::weak, fmt::format("{:.0f} % of the sensor's steps fit nothing", 100 * f.outliers));
  if (f.inflation > 3) e.doubt(Verdict::weak, "the residuals are far from independent: the model misses something");
  if (*e.sigma_s > 0.25 * p.step_s && *e.sigma_s > 2e-3)
    e.doubt(Verdict::weak,
            fmt::format("little is known: the motion fixes the offset to {:.1f} ms only", 1e3 * *e.sigma_s));
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

/// Bearings know the translation apart from the rotation, and are believed where they fit; where they do not (few
/// points, a lens that is not known), the apparent rotations are surer.
bool prefer_bearings(const LikelihoodFit& rotation, const LikelihoodFit& bearings) {
  if (!bearings.converged || !rotation.converged) return bearings.converged;
  return bearings.relative_error < credible_relative_error || bearings.relative_error < rotation.relative_error;
}

/// Where the two likelihoods are far apart and the plain correlation sides with the other one, the answer is in doubt.
void hear_third_witness(Estimate& answer, const Estimate& second, const Estimate& correlation) {
  if (!answer.answered() || !correlation.answered()) return;
  if (!second.answered()) {
    answer.doubt(Verdict::weak, "with and without translation in the model do not both lead to an answer");
    return;
  }
  // A rolling shutter that only one of them models accounts for a difference.
  if (std::abs(answer.line_delay_s.value_or(0) - second.line_delay_s.value_or(0)) > 2e-6) return;
  const double apart = to_seconds(*answer.offset - *second.offset);
  const double allowed = std::hypot(*answer.sigma_s, *second.sigma_s);
  const auto from_correlation = [&](const Estimate& e) {
    return std::abs(to_seconds(*e.offset - *correlation.offset));
  };
  if (std::abs(apart) > significant_sigmas * allowed && from_correlation(answer) > from_correlation(second))
    answer.doubt(Verdict::weak,
                 fmt::format("with and without translation in the model the answers are {:.2f} ms apart, {:.1f} times "
                             "their uncertainty, and the correlation is nearer to the other",
                             1e3 * std::abs(apart), std::abs(apart) / allowed));
}

/// The two likelihoods look at the same pictures in two ways, and err in two ways: one by noise, the other by a
/// translation that it takes for rotation. Where both fit and agree, the answer is their weighted mean, its sigma wider
/// by as much as they are apart (the Birge ratio). Where they disagree, translation explains it, and the bearings
/// stand.
void join(Estimate& answer, const Estimate& second, const LikelihoodFit& fine, const LikelihoodFit& other) {
  if (!answer.answered() || !second.answered()) return;
  if (std::max(fine.relative_error, other.relative_error) > credible_relative_error) return;
  // A rolling shutter is seen by the bearings alone: the other answer then is for some middle row.
  if (std::abs(fine.readout_s - other.readout_s) > shortest_readout_s) return;
  const double apart =
      to_seconds(*second.offset - *answer.offset) + second.drift.value_or(0) * to_seconds(answer.epoch - second.epoch);
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

}  // namespace

Estimate align_rotation(const RotationSignal& sensor, const ImuStream& reference, const AlignmentOptions& options) {
  check(reference);
  const Estimate base = blank(sensor, reference, "ml");
  const auto refuse = [&](const std::string& why) {
    Estimate e = base;
    e.doubt(Verdict::refused, why);
    return e;
  };
  if (sensor.increments.size() < fewest_steps)
    return refuse(fmt::format("only {} rotations of the sensor were measured; {} is the least that can be aligned",
                              sensor.increments.size(), fewest_steps));
  if (reference.size() < fewest_steps)
    return refuse(fmt::format("only {} samples of the reference; {} is the least", reference.size(), fewest_steps));

  const Problem problem(sensor, reference);
  if (problem.steps.size() < fewest_steps)
    return refuse(fmt::format("only {} of the sensor's {} rotations could be measured", problem.steps.size(),
                              sensor.increments.size()));
  const double between = to_seconds(problem.between_epochs());
  const double widest = std::numeric_limits<double>::infinity();
  const double search = options.search_s.value_or(widest);
  const Correlation coarse = correlate(problem, -search - between, search - between);
  if (const auto why = no_answer(measure_excitation(problem), coarse, problem)) {
    Estimate e = refuse(*why);
    if (!coarse.curve_r.empty()) e.evidence.panels.push_back(correlation_panel(problem, coarse));
    return e;
  }
  Coarse start = follow_drift(problem, coarse);
  if (sensor.focal_assumed) start.log_focal = fit_log_focal(problem, start);
  const PhaseFit phase = fit_phase(problem, start);
  const bool has_bearings = !problem.pairs.empty();
  const LikelihoodFit by_rotation = fit_fine(problem, start, options, false);
  const LikelihoodFit by_bearings = has_bearings ? fit_fine(problem, start, options, true) : LikelihoodFit{};
  const bool bearings_win = prefer_bearings(by_rotation, by_bearings);
  const LikelihoodFit& fine = bearings_win ? by_bearings : by_rotation;

  std::vector<Estimate> all{correlation_estimate(problem, coarse, base), phase_estimate(problem, phase, start, base),
                            tdicp_estimate(problem, start, base), ml_estimate(problem, fine, start, base, options)};
  if (has_bearings) {
    const LikelihoodFit& other = bearings_win ? by_rotation : by_bearings;
    Estimate second = ml_estimate(problem, other, start, base, options);
    second.method = bearings_win ? "ml-rotation" : "ml-bearings";
    hear_third_witness(all.back(), second, all.front());
    join(all.back(), second, fine, other);
    all.push_back(std::move(second));
  }
  if (fine.converged && fine.drift != 0)
    for (Estimate& e : all)
      if (!e.method.starts_with("ml") && e.answered())
        e.doubt(Verdict::weak, fmt::format("the clocks drift by {:.1f} ± {:.1f} ppm, which this method does not model",
                                           1e6 * fine.drift, 1e6 * fine.drift_sigma));
  Estimate answer = chosen(all, options.method);
  const bool fitted = fine.converged;
  const double offset = fitted ? fine.offset_s : start.offset_s, drift = fitted ? fine.drift : start.drift;
  const double centre = fitted ? fine.centre_s : start.centre_s;
  const Mat3 R = fitted ? fine.R_reference_sensor : start.R_reference_sensor;
  answer.evidence.panels = {rates_panel(problem, offset, drift, centre, R, false),
                            rates_panel(problem, offset, drift, centre, R, true),
                            correlation_panel(problem, coarse),
                            windows_panel(fine),
                            residuals_panel(fine),
                            coherence_panel(phase)};
  answer.estimates = std::move(all);
  return answer;
}

}  // namespace takt
