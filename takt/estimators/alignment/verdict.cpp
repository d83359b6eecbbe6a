// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "takt/estimators/alignment/rivals.h"

namespace takt::alignment {

namespace {

/// Below this share of common rotation, with both sides sure of themselves, they do not see the same motion.
constexpr double disagreement = 0.4, doubtful_agreement = 0.85;
/// "Sure of themselves": they misfit beyond their claims, in general or in proportion to the turn.
constexpr double claimed_misfit = 3, relative_misfit = 0.15;
/// A motion this far above the noise must correlate, if it is the same.
constexpr double strong_motion = 5, least_correlation = 0.5, unrivalled_correlation = 0.85;
constexpr double plausible_drift = 5e-4;
/// A witness that may as well have seen the one as the other says nothing.
constexpr double witness_sigmas = 2;

}  // namespace

double apart_s(const Estimate& a, const Estimate& b) {
  return to_seconds(*b.offset - *a.offset) + b.drift.value_or(0) * to_seconds(a.epoch - b.epoch);
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

namespace {

/// By how many sigmas of its own a witness sides with `b` against `a`; negative where it sides with `a`.
double sides_with(const Estimate& witness, const Estimate& a, const Estimate& b) {
  if (!witness.answered() || !witness.sigma_s || !(*witness.sigma_s > 0)) return 0;
  const double from_a = apart_s(a, witness) / *witness.sigma_s, from_b = apart_s(b, witness) / *witness.sigma_s;
  const double evidence = from_a * from_a - from_b * from_b;
  return std::copysign(std::sqrt(std::abs(evidence)), evidence);
}

}  // namespace

void hear_third_witness(Estimate& answer, const Estimate& second, const Estimate& correlation, bool knows_translation) {
  if (!answer.answered() || !correlation.answered()) return;
  if (!second.answered()) {
    if (!knows_translation)
      answer.doubt(Verdict::weak, "with and without translation in the model do not both lead to an answer");
    return;
  }
  const double apart = apart_s(answer, second);
  const double allowed = std::hypot(*answer.sigma_s, *second.sigma_s);
  const double for_second = sides_with(correlation, answer, second);
  if (std::abs(apart) > significant_sigmas * allowed && for_second > witness_sigmas)
    answer.doubt(Verdict::weak,
                 fmt::format("with and without translation in the model the answers are {:.2f} ms apart, {:.1f} times "
                             "their uncertainty, and the correlation sides with the other by {:.1f} of its own",
                             1e3 * std::abs(apart), std::abs(apart) / allowed, for_second));
}

void confront(Estimate& simpler, const Estimate& likelihood) {
  if (!simpler.answered()) return;
  if (likelihood.verdict != Verdict::trusted && !likelihood.reasons.empty()) {
    simpler.doubt(likelihood.verdict, "the maximum likelihood is in doubt: " + likelihood.reasons.front());
    return;
  }
  if (!likelihood.answered()) return;
  const double apart = apart_s(simpler, likelihood), allowed = std::hypot(*simpler.sigma_s, *likelihood.sigma_s);
  if (std::abs(apart) > 3 * allowed)
    simpler.doubt(Verdict::weak, fmt::format("the maximum likelihood is {:.3f} ms away, {:.1f} times the uncertainty",
                                             1e3 * apart, std::abs(apart) / allowed));
  // What it says differently from one who knows more is its own error.
  *simpler.sigma_s = std::hypot(*simpler.sigma_s, std::max(0.0, std::abs(apart) - *likelihood.sigma_s));
}

}  // namespace takt::alignment
