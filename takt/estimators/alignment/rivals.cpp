// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/rivals.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "takt/estimators/alignment/focal.h"
#include "takt/estimators/alignment/likelihood.h"

namespace takt::alignment {

namespace {

constexpr std::size_t most_rivals = 5;
/// A winner explains this share of the turn; less is no answer, however bad the others are.
constexpr double winning_share = 0.85;
/// Offset, rotation and bias: what a fit can adapt to the data that it is judged by.
constexpr double fitted_numbers = 7;

LikelihoodFit fit_at(const Problem& problem, const Peak& peak, double lobe_s) {
  Coarse start;
  start.offset_s = peak.offset_s;
  start.centre_s = 0.5 * (problem.steps.front().t0 + problem.steps.back().t1);
  start.R_reference_sensor = peak.R_reference_sensor;
  start.lobe_s = lobe_s;
  LikelihoodOptions plain;
  plain.bearings = !problem.pairs.empty();
  plain.drift = false;
  plain.readout_prior_s = plain.readout_start_s = problem.signal.timing.readout_s;
  plain.readout_prior_sigma_s = 0;
  if (problem.signal.focal_assumed) plain.log_focal = start.log_focal = fit_log_focal(problem, start);
  return maximise_likelihood(problem, start, plain);
}

/// Log likelihood of a step, the fit's own freedom taken off.
double per_step(const LikelihoodFit& fit) {
  return fit.converged && fit.used > 0 ? (fit.log_likelihood - fitted_numbers) / static_cast<double>(fit.used)
                                       : -std::numeric_limits<double>::infinity();
}

}  // namespace

void settle_rivals(const Problem& problem, Correlation& correlation) {
  if (correlation.peaks.size() < 2 || !(correlation.rival_margin < clear_margin)) return;
  const std::size_t rivals = std::min(correlation.peaks.size(), most_rivals);
  std::vector<LikelihoodFit> fits;
  for (std::size_t i = 0; i < rivals; ++i) fits.push_back(fit_at(problem, correlation.peaks[i], correlation.lobe_s));
  std::size_t best = 0;
  for (std::size_t i = 1; i < rivals; ++i)
    if (per_step(fits[i]) > per_step(fits[best])) best = i;
  if (!fits[best].converged || fits[best].explained < winning_share) return;
  double margin = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < rivals; ++i) {
    if (i == best || !fits[i].converged) continue;
    const auto shared = static_cast<double>(std::min(fits[i].used, fits[best].used));
    margin = std::min(margin, shared * (per_step(fits[best]) - per_step(fits[i])));
  }
  if (margin < clear_margin) return;
  const auto first = correlation.peaks.begin();
  std::rotate(first, first + static_cast<std::ptrdiff_t>(best), first + static_cast<std::ptrdiff_t>(best) + 1);
  correlation.rival_margin = margin;
}

}  // namespace takt::alignment
