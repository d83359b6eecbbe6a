// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/estimators/alignment/correlation.h"
#include "takt/estimators/alignment/excitation.h"
#include "takt/estimators/alignment/likelihood.h"

/// When an alignment refuses, and what makes it doubt itself; each with its reason in words.
namespace takt::alignment {

/// So many sigmas are no chance.
inline constexpr double significant_sigmas = 4;

/// Reasons not to answer at all, found before any fine estimate.
[[nodiscard]] std::optional<std::string> no_answer(const Excitation& x, const Correlation& c, const Problem& p);

/// What a fine fit says against itself.
void doubt_fit(Estimate& e, const Problem& p, const LikelihoodFit& f, const Coarse& start);

/// Where the two likelihoods are far apart and the plain correlation sides with the other one, by more than its own
/// sigma, the answer is in doubt. Where the other one has no answer, so is an answer that does not itself know the
/// translation apart and fit.
void hear_third_witness(Estimate& answer, const Estimate& second, const Estimate& correlation, bool knows_translation);

/// A method that knows less than the likelihood is not surer than it.
void confront(Estimate& simpler, const Estimate& likelihood);

/// b − a (s), both at a's epoch.
[[nodiscard]] double apart_s(const Estimate& a, const Estimate& b);

}  // namespace takt::alignment
