// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/per_swing.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "takt/math/median.h"

namespace takt::pendulum {
namespace {

constexpr double pi = std::numbers::pi;

/// The angle's and the rate's wave over one swing, the rate's sign turned to the mounting's. The rate's window starts
/// `rate_lead_s` before the angle's, the coarse delay apart.
struct Waves {
  Harmonic angle, rate;
};
std::optional<Waves> fit_swing(const Signals& s, const Coarse& coarse, const Swing& swing, double rate_lead_s,
                               bool with_decay) {
  const double guess = 2 * pi / swing.period_s(), shift = coarse.delay_s - rate_lead_s;
  const auto angle = fit_harmonic(s.angle_time_s, s.angle_rad, swing.from_s, swing.to_s, guess, with_decay);
  auto rate = fit_harmonic(s.rate_time_s, s.rate_rad_s, swing.from_s + shift, swing.to_s + shift, guess, with_decay);
  if (!angle || !rate) return std::nullopt;
  if (coarse.scale < 0) rate->phase_rad += pi;
  return Waves{*angle, *rate};
}

}  // namespace

std::vector<SwingDelay> extrema_delays(const Signals& signals, const Coarse& coarse, const std::vector<Swing>& swings) {
  std::vector<SwingDelay> out;
  for (const Swing& swing : swings) {
    // Each sensor's swing begins at its own upward passage through zero. A plain sine fitted to a dying one is shifted
    // by (δ/2ω')·cos 2φ, φ the phase in the middle of the window: with the same φ in both the shifts cancel, and what
    // remains is β alone.
    const auto waves = fit_swing(signals, coarse, swing, swing.period_s() / 4, false);
    if (!waves) continue;
    const double period = 2 * pi / waves->angle.frequency_rad_s;
    // Both the highest and the lowest point of the swing, each with the rate's extremum a quarter period before it.
    SwingDelay d;
    d.swing = swing;
    for (const double side : {-0.25, 0.25}) {
      const double t3 = waves->angle.extremum_near(swing.middle_s() + side * period);
      const double t2 = waves->rate.extremum_near(t3 - period / 4 + coarse.delay_s);
      d.delay_s += 0.5 * (t2 - t3 + period / 4);
    }
    d.angle = waves->angle;
    d.rate = waves->rate;
    out.push_back(d);
  }
  return out;
}

std::vector<SwingDelay> damped_delays(const Signals& signals, const Coarse& coarse, const std::vector<Swing>& swings) {
  std::vector<SwingDelay> out;
  for (const Swing& swing : swings) {
    const auto waves = fit_swing(signals, coarse, swing, 0, true);
    if (!waves) continue;
    const double w = waves->angle.frequency_rad_s, damping = waves->angle.decay_per_s;
    const double lead = pi / 2 + std::atan2(damping, w);  // arg λ: the quarter turn and the phase β of eq. 9
    const double missing = std::remainder(waves->angle.phase_rad + lead - waves->rate.phase_rad, 2 * pi) / w;
    SwingDelay d;
    d.swing = swing;
    d.delay_s = coarse.delay_s + missing;
    d.damping_per_s = damping;
    d.angle = waves->angle;
    d.rate = waves->rate;
    out.push_back(d);
  }
  return out;
}

Estimate average(std::string method, std::vector<SwingDelay>& delays, const Signals& signals) {
  if (delays.size() < 3)
    return Estimate::refusal(std::move(method),
                             fmt::format("only {} swings could be fitted, 3 are needed", delays.size()));
  std::vector<double> values, deviations;
  for (const SwingDelay& d : delays) values.push_back(d.delay_s);
  const double centre = median(values);
  for (const double v : values) deviations.push_back(std::abs(v - centre));
  const double spread = 1.4826 * median(deviations);
  double sum = 0, squares = 0, time = 0;
  int n = 0;
  for (SwingDelay& d : delays) {
    d.outlier = std::abs(d.delay_s - centre) > 3 * spread;
    if (d.outlier) continue;
    ++n;
    sum += d.delay_s;
    time += d.swing.middle_s();
  }
  const double mean = sum / n;
  for (const SwingDelay& d : delays)
    if (!d.outlier) squares += (d.delay_s - mean) * (d.delay_s - mean);
  Estimate e;
  e.method = std::move(method);
  e.verdict = Verdict::trusted;
  e.offset = from_seconds(mean);
  e.sigma_s = std::sqrt(squares / std::max(1, n - 1) / n);
  e.epoch = signals.epoch + from_seconds(time / n);
  e.extras.push_back({"swings", static_cast<double>(n), std::nullopt});
  e.extras.push_back({"swing_scatter_s", std::sqrt(squares / std::max(1, n - 1)), std::nullopt});
  if (n < 6) e.doubt(Verdict::weak, fmt::format("only {} swings agree", n));
  return e;
}

double neglected_phase_s(const std::vector<SwingDelay>& damped) {
  double sum = 0;
  int n = 0;
  for (const SwingDelay& d : damped) {
    if (d.outlier) continue;
    sum += std::atan2(d.damping_per_s, d.angle.frequency_rad_s) / d.angle.frequency_rad_s;
    ++n;
  }
  return n > 0 ? sum / n : 0;
}

}  // namespace takt::pendulum
