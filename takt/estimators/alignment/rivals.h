// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/estimators/alignment/correlation.h"
#include "takt/estimators/alignment/problem.h"

namespace takt::alignment {

/// The rival must explain the data worse by this much (nats): e¹² to one.
inline constexpr double clear_margin = 12;

/// Where the correlation cannot tell offsets apart, the likelihood at each of them may: it knows translation, bias and
/// the noise of every step, all of which the correlation takes for turning. Puts the clear winner first and its margin
/// into `rival_margin`; leaves everything as it was where there is none, as for a motion that repeats itself.
void settle_rivals(const Problem& problem, Correlation& correlation);

}  // namespace takt::alignment
