// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/moving_offset.h"

#include <algorithm>
#include <cmath>

namespace takt::online {

namespace {

/// Odds at the start that a camera's clock runs as the IMU's does. A drift is soon found out, and until then its chance
/// widens the answer of every rig that has none.
constexpr double no_drift_odds = 8;
/// Crystals that are not one rarely run further apart than this many of their usual sigmas.
constexpr double usual_drift = 1.5;

/// By how much the belief in one clock is off if the two run `drift` apart, 0 where so much would have shown: its odds
/// against none would then be even, less two sigmas of chance.
double hidden_by(double drift, const OffsetAndDrift& x, double drift_sigma) {
  const double sigma = std::sqrt(x.drift_variance);
  const double shows_from = std::sqrt(2 * std::log(std::max(1.0, no_drift_odds * drift_sigma / sigma))) + 2;
  return drift > shows_from * sigma ? 0 : std::abs(x.covariance) / x.drift_variance * drift;
}

}  // namespace

void believe(const OffsetAndDrift& x, double drift_sigma, OffsetBelief& b) {
  // Two clocks either run apart or are one. Conditioning on no drift is exact, and how likely it is follows from the
  // density at zero after and before the data [Dickey1971].
  const double var = x.offset_variance, drift_var = x.drift_variance;
  const double still_offset = x.offset_s - x.covariance / drift_var * x.drift;
  const double still_var = std::max(var - x.covariance * x.covariance / drift_var, 0.0);
  const double log_odds =
      std::log(no_drift_odds * drift_sigma) - 0.5 * std::log(drift_var) - 0.5 * x.drift * x.drift / drift_var;
  const double w = 1 / (1 + std::exp(-log_odds));
  b.offset_s = w * still_offset + (1 - w) * x.offset_s;
  const double apart = still_offset - x.offset_s;
  b.sigma_s = std::sqrt(w * still_var + (1 - w) * var + w * (1 - w) * apart * apart);
  b.apart = x;
  b.hidden_drift_s = hidden_by(usual_drift * drift_sigma, x, drift_sigma);
  b.drift = (1 - w) * x.drift;
  b.drift_sigma = std::sqrt((1 - w) * drift_var + w * (1 - w) * x.drift * x.drift);
}

bool StepWatch::observe(double correction_s, double variance_before, double variance_after) {
  constexpr std::size_t window = 40, shortest = 5;
  constexpr double surely = 6, shortest_step_s = 3e-4;
  corrections_.emplace_back(correction_s, std::max(0.0, variance_before - variance_after));
  if (corrections_.size() > window) corrections_.pop_front();
  double sum = 0, variance = 0;
  std::size_t count = 0;
  bool stepped = false;
  of_corrections_ = 0;
  for (auto it = corrections_.rbegin(); it != corrections_.rend(); ++it) {
    sum += it->first, variance += it->second;
    if (++count < shortest || !(variance > 0)) continue;
    // The correction is that share of a step which the data outweigh what was known.
    const double step_s = sum * variance_before / variance;
    if (std::abs(step_s) < shortest_step_s) continue;
    of_corrections_ = std::max(of_corrections_, std::abs(sum) / std::sqrt(variance));
    stepped = stepped || of_corrections_ > surely;
  }
  return stepped;
}

void StepWatch::observe_slip(const FrameSlip& of, double time_sigma_s) {
  constexpr std::size_t window = 5;
  slips_.push_front(of.sigmas(time_sigma_s));
  if (slips_.size() > window) slips_.pop_back();
  of_slips_ = 0;
  double sum = 0, count = 0;
  for (const double slip : slips_) {
    sum += slip, count += 1;
    of_slips_ = std::max(of_slips_, std::abs(sum) / std::sqrt(count * (1 + (count - 1) * of.shared())));
  }
}

}  // namespace takt::online
