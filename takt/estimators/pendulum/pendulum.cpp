// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/pendulum.h"

#include <fmt/core.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "takt/estimators/pendulum/evidence.h"
#include "takt/estimators/pendulum/joint_spline.h"
#include "takt/estimators/pendulum/jump.h"
#include "takt/estimators/pendulum/per_swing.h"

namespace takt {
namespace {

using namespace pendulum;
constexpr double deg = std::numbers::pi / 180;
constexpr std::size_t fewest_swings = 4;

/// The swings to be used, and what is to be said about the choice.
struct Window {
  std::vector<Swing> swings;
  std::string note;
};

/// Why this is no swinging pendulum in the units that it claims, or empty.
std::string refuse_motion(const Signals& s, const Swings& swings) {
  if (!s.refusal.empty()) return s.refusal;
  double low = 1e300, high = -1e300;
  for (const double a : s.angle_rad) low = std::min(low, a), high = std::max(high, a);
  const double reach = 0.5 * (high - low);
  if (reach < 30 * s.angle_noise_rad)
    return fmt::format("{}: the angle varies by ±{:.4f}° with a noise of {:.4f}°; release it from some 15°",
                       reach < 0.5 * deg ? "the pendulum is at rest" : "no swing stands out of the noise", reach / deg,
                       s.angle_noise_rad / deg);
  if (reach > std::numbers::pi)
    return fmt::format("the angle varies by ±{:.4g} rad: no pendulum swings so far; is the angle in degrees?", reach);
  if (swings.all.size() < fewest_swings)
    return fmt::format("too few swings: {} whole ones were found, {} are needed: record a minute or two",
                       swings.all.size(), fewest_swings);
  if (swings.period_s < 0.1 || swings.period_s > 30)
    return fmt::format("one swing lasts {:.3g} s: are the stamps in another unit?", swings.period_s);
  if (swings.period_s < 6 * s.frame_interval_s)
    return fmt::format("one swing lasts {:.3f} s, less than 6 frames of {:.3f} s", swings.period_s, s.frame_interval_s);
  return "";
}

/// Within a quarter of the period; motion that does not repeat itself is sought further away too.
Coarse first_match(const Signals& s, const Swings& swings) {
  const Coarse near = coarse_match(s, swings.period_s / 4);
  if (swings.free) return near;
  const double length =
      std::min(s.angle_time_s.back() - s.angle_time_s.front(), s.rate_time_s.back() - s.rate_time_s.front());
  const Coarse far = coarse_match(s, 0.4 * length);
  // Of a motion that nearly repeats itself a far match is a little better by chance.
  const auto unlike = [](const Coarse& c) { return 1 - c.correlation * c.correlation; };
  return unlike(far) < 0.2 * unlike(near) ? far : near;
}

/// Why angle and rate do not belong together, or empty.
std::string refuse_match(const Coarse& coarse) {
  if (coarse.correlation < 0.7)
    return fmt::format(
        "the gyro does not follow the angle: their best correlation is {:.2f}; are both of "
        "this run and of this bob?",
        coarse.correlation);
  const double scale = std::abs(coarse.scale);
  if (std::abs(scale * deg - 1) < 0.1)
    return fmt::format(
        "the gyro reads {:.1f} times the angle's rate: its rates look like degrees per second "
        "(--rate-unit deg_s reads them so)",
        scale);
  if (std::abs(scale / deg - 1) < 0.1)
    return fmt::format(
        "the gyro reads 1/{:.1f} of the angle's rate: the angles look like degrees (name their column angle_deg)",
        1 / scale);
  return "";
}

/// For the two methods that take swing by swing.
Window published_window(const Swings& swings, const PendulumOptions& options) {
  if (!swings.free)
    return {swings.all, fmt::format("the bob does not swing freely ({}); all of its motion is used", swings.not_free)};
  Window w{within(swings.all, options.window_from_deg * deg, options.window_to_deg * deg), ""};
  if (w.swings.size() >= fewest_swings || options.window_is_required) return w;
  w.note = fmt::format("{} swings lie between {:g}° and {:g}°, so all {} from {:.2f}° to {:.2f}° are used",
                       w.swings.size(), options.window_from_deg, options.window_to_deg, swings.all.size(),
                       swings.all.front().amplitude_rad / deg, swings.all.back().amplitude_rad / deg);
  w.swings = swings.all;
  return w;
}

/// For the joint fit, the first choice first.
std::vector<Window> spline_windows(const Swings& swings, const Window& published, const PendulumOptions& options) {
  if (!swings.free || options.window_is_required) return {published};
  const double least = 0.1 * swings.amplitude_rad, from = options.window_from_deg * deg;
  std::vector<Window> windows{{within(swings.all, 1e9, least), ""}, {within(swings.all, from, least), ""}};
  const std::size_t before = windows[0].swings.size() - windows[1].swings.size();
  if (before == 0 || windows[1].swings.size() < 2 * fewest_swings) windows.pop_back();
  if (windows.size() > 1)
    windows[1].note = fmt::format("the first {} swings, above {:g}°, disturb more than they tell and were left out",
                                  before, options.window_from_deg);
  return windows;
}

SplineTask task_for(const Swings& swings, const Window& window, const Coarse& coarse, bool line_delay) {
  SplineTask task;
  task.from_s = window.swings.front().from_s;
  task.to_s = window.swings.back().to_s;
  task.period_s = swings.period_s;
  task.rest_rad = swings.rest_rad;
  task.amplitude_rad = swings.amplitude_rad;
  task.coarse = coarse;
  task.free_swing = swings.free;
  task.line_delay = line_delay;
  // A stretch a swing, or a few swings where a recording is long.
  const std::size_t every = window.swings.size() / 200 + 1;
  for (std::size_t i = every; i < window.swings.size(); i += every) task.cuts_s.push_back(window.swings[i].from_s);
  return task;
}

/// Why the two streams' delay is no one number, or empty.
std::string refuse_fit(const SplineFit& fit, const Signals& signals, double period_s) {
  const char* const lost = "were frames or samples lost while their stamps went on?";
  if (const std::string why = refuse_stretches(fit.stretches); !why.empty()) return why;
  // Data without any noise leave the fit's own small errors, which spoil no delay.
  if (const double excess = fit.rate_density / std::max(signals.rate_density, 1e-12);
      excess > 10 && fit.delay_sigma_s > 1e-4 * period_s)
    return fmt::format(
        "no motion explains angle and rate together: the fit leaves {:.0f} times the gyro's noise; {} Or "
        "is the gyro clipped, or its low-pass slower than 20 ms?",
        excess, lost);
  if (fit.delay_sigma_s > 0.02 * period_s)
    return fmt::format("the delay cannot be told better than to {:.0f} ms: {}", fit.delay_sigma_s * 1e3, lost);
  if (fit.scatter_about_drift > 30)
    return fmt::format("the delays of single swings scatter {:.0f} times more than the noise explains: {}",
                       fit.scatter_about_drift, lost);
  return "";
}

Estimate from_spline(const SplineFit& fit, const Signals& signals, double period_s, const PendulumOptions& options) {
  if (!fit.failure.empty()) return Estimate::refusal("spline", fit.failure);
  Estimate e;
  e.method = "spline";
  e.verdict = Verdict::trusted;
  e.offset = from_seconds(fit.delay_s);
  e.sigma_s = fit.delay_sigma_s;
  e.epoch = signals.epoch + from_seconds(fit.epoch_s);
  if (options.estimate_line_delay) {
    e.line_delay_s = fit.line_delay_s;
    e.line_delay_sigma_s = fit.line_delay_sigma_s;
  }
  e.extras = {{"gyro_scale", fit.scale, fit.scale_sigma},
              {"gyro_bias_rad_s", fit.bias_rad_s, std::nullopt},
              {"angle_noise_rad", fit.angle_sigma_rad, std::nullopt},
              {"gyro_density_rad_s_sqrt_hz", fit.rate_density, std::nullopt},
              {"dry_friction_rad_s2", fit.dry_friction_rad_s2, fit.dry_friction_sigma},
              {"knot_interval_s", fit.knot_interval_s, std::nullopt},
              {"angles_left_out", static_cast<double>(fit.dropped_angles), std::nullopt},
              {"rates_left_out", static_cast<double>(fit.dropped_rates), std::nullopt},
              {"drift_tested", fit.drift, fit.drift_sigma},
              {"swing_scatter_over_noise", fit.scatter, std::nullopt}};
  if (options.stamps_are_triggers) e.extras.push_back({"trigger_lead_s", -fit.delay_s, fit.delay_sigma_s});

  // χ²/n of the swings' delays scatters by √(2/n); only what lies 4 of that above 1 is taken for real.
  const double chance = fit.scatter_dof > 0 ? 4 * std::sqrt(2.0 / fit.scatter_dof) : 0;
  const bool drifts = std::abs(fit.drift) > 5 * fit.drift_sigma && fit.drift_sigma > 0;
  if (const std::string why = refuse_fit(fit, signals, period_s); !why.empty()) {
    e.doubt(Verdict::refused, why);
  } else if (drifts) {
    e.drift = fit.drift;
    e.drift_sigma = fit.drift_sigma;
    e.doubt(Verdict::weak, fmt::format("the delay drifts by {:.2f} ± {:.2f} ppm during the swings: the two streams do "
                                       "not keep the same time",
                                       fit.drift * 1e6, fit.drift_sigma * 1e6));
  } else if (fit.scatter_dof > 0 && fit.scatter * fit.scatter > 1 + chance) {
    *e.sigma_s *= fit.scatter;
    const bool much = fit.scatter > 2;
    e.doubt(much ? Verdict::weak : Verdict::trusted,
            fmt::format("the delays of single swings scatter {:.1f} times more than the noise explains; the "
                        "uncertainty was widened by that",
                        fit.scatter));
  }
  return e;
}

/// How far the swings' delays are from agreeing: 1 where the noise explains it all.
double disagreement(const SplineFit& fit) {
  if (!fit.failure.empty()) return 1e9;
  const double drift = fit.drift_sigma > 0 ? std::abs(fit.drift) / (5 * fit.drift_sigma) : 0;
  const double chance = fit.scatter_dof > 0 ? 4 * std::sqrt(2.0 / fit.scatter_dof) : 0;
  return std::max({1.0, drift, fit.scatter * fit.scatter / (1 + chance)});
}

/// What was fitted, and to which swings.
struct Fitted {
  SplineFit fit;
  Window window;
  Coarse coarse;
  std::string turns;  ///< what is to be said where the offset is longer than a quarter of the period
};

/// Whether the motion before `until_s` is more than the noise of the rest: then the swings after it may tell more
/// alone.
bool beginning_disturbs(const SplineFit& fit, double until_s) {
  if (disagreement(fit) > 1 || fit.knots_halved) return true;
  double before = 0, after = 0, n_before = 0, n_after = 0;
  for (std::size_t i = 0; i < fit.rate_time_s.size(); ++i) {
    const bool early = fit.rate_time_s[i] - fit.delay_s < until_s;
    (early ? before : after) += fit.rate_residual_rad_s[i] * fit.rate_residual_rad_s[i];
    (early ? n_before : n_after) += 1;
  }
  return before * n_after > (1 + 4 * std::sqrt(2 / std::max(1.0, n_before))) * after * n_before;
}

/// The window that tells the delay best, of those whose swings agree.
Fitted fit_best_window(const Signals& signals, const Swings& swings, const std::vector<Window>& windows,
                       const Coarse& coarse, bool line_delay) {
  Fitted best;
  for (const Window& window : windows) {
    if (!best.window.swings.empty() && !beginning_disturbs(best.fit, window.swings.front().from_s)) break;
    SplineFit fit = fit_joint_spline(signals, task_for(swings, window, coarse, line_delay));
    const bool agrees = disagreement(fit) <= 1, better = agrees && fit.delay_sigma_s < best.fit.delay_sigma_s;
    if (best.window.swings.empty() || (better && disagreement(best.fit) <= 1) ||
        disagreement(fit) < 0.5 * disagreement(best.fit))
      best = {std::move(fit), window, coarse, ""};
  }
  return best;
}

/// By how much a half swing gets shorter in a second as the amplitude dies: a line through the periods.
double half_swing_change(const std::vector<Swing>& swings) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const Swing& s : swings) {
    const double t = s.middle_s(), half = 0.5 * s.period_s();
    ++n, x += t, y += half, xx += t * t, xy += t * half;
  }
  const double spread = n * xx - x * x;
  return spread > 0 ? (n * xy - x * y) / spread : 0;
}

/// Half swings look alike, but each is a little shorter than the one before. Compared k half swings apart, the delay
/// drifts by k times that; where it does, the streams are tried k half swings apart.
void count_half_swings(Fitted& found, const Signals& signals, const Swings& swings, bool line_delay) {
  const SplineFit& fit = found.fit;
  if (!swings.free || !fit.failure.empty() || !(std::abs(fit.drift) > 5 * fit.drift_sigma)) return;
  const double change = half_swing_change(found.window.swings), half = 0.5 * swings.period_s;
  const double turns = change != 0 ? std::round(fit.drift / change) : 0;
  if (turns == 0 ||
      std::abs(turns) * half > 0.4 * (found.window.swings.back().to_s - found.window.swings.front().from_s))
    return;
  for (const double k : {turns, turns - 1, turns + 1}) {
    Coarse coarse = found.coarse;
    coarse.delay_s -= k * half;
    if (std::fmod(std::abs(k), 2) == 1) coarse.scale = -coarse.scale;
    SplineFit other = fit_joint_spline(signals, task_for(swings, found.window, coarse, line_delay));
    if (disagreement(other) > 1) continue;
    found.turns = fmt::format(
        "the streams' stamps are {:.3f} s apart, more than a quarter of the period of {:.3f} s: the half swings were "
        "counted by how their length changes, {:+.0f} of them",
        other.delay_s, swings.period_s, -k);
    found.fit = std::move(other);
    found.coarse = coarse;
    return;
  }
}

void doubt_conditions(Estimate& e, const Signals& s, const Swings& swings, const Fitted& found) {
  if (!e.answered()) return;
  const Window& window = found.window;
  if (window.swings.size() < 8)
    e.doubt(Verdict::weak, fmt::format("only {} swings were recorded", window.swings.size()));
  if (!found.turns.empty())
    e.doubt(Verdict::weak, found.turns);
  else if (std::abs(to_seconds(*e.offset)) > 0.22 * swings.period_s)
    e.doubt(Verdict::weak,
            fmt::format("an offset near a quarter of the period ({:.3f} s) cannot be told from one half a period away "
                        "with the gyro mounted the other way round",
                        swings.period_s / 4));
  if (const double scale = std::abs(found.coarse.scale); scale < 0.8 || scale > 1.25)
    e.doubt(Verdict::weak, fmt::format("the gyro reads {:.2f} times the angle's rate: check the dial's scale and the "
                                       "units of both",
                                       scale));
  if (s.axis_share < 0.8)
    e.doubt(Verdict::weak, fmt::format("only {:.0f} % of the rotation is about one axis", 100 * s.axis_share));
  if (s.saturated > 0) {
    const double share = static_cast<double>(s.saturated) / static_cast<double>(s.saturated + s.rate_time_s.size());
    e.doubt(share > 0.5 ? Verdict::refused : Verdict::weak,
            fmt::format("the gyro stands at its limit of {:.2f} rad/s; {:.0f} % of its readings were left out",
                        s.saturation_rad_s, 100 * share));
  }
  for (const std::string& doubt : s.doubts) e.doubt(Verdict::weak, doubt);
  if (s.stamp_sigma_s > 0.3 * *e.sigma_s) {
    e.sigma_s = std::hypot(*e.sigma_s, s.stamp_sigma_s);
    e.doubt(Verdict::trusted, fmt::format("stamps come in steps of {:.3g} ms; the uncertainty was widened by what they "
                                          "may be rounded",
                                          s.stamp_sigma_s * std::sqrt(12.0) * 1e3));
  }
  for (const std::string& note : s.notes) e.doubt(Verdict::trusted, note);
  if (!window.note.empty()) e.doubt(Verdict::trusted, window.note);
}

/// What makes the joint fit doubtful makes the two others doubtful as well.
void share_doubt(const Estimate& result, Estimate& e) {
  if (result.verdict != Verdict::trusted && e.answered() && !result.reasons.empty())
    e.doubt(Verdict::weak, "the joint fit: " + result.reasons.front());
}

/// The two per-swing methods assume a bob that swings freely; a hand in it makes them wrong without a sign.
void refuse_hand_moved(Estimate& e, const Swings& swings) {
  if (!swings.free && e.answered()) e.doubt(Verdict::refused, "this method needs a free swing: " + swings.not_free);
}

void warn_of_neglected_phase(Estimate& extrema, double neglected_s) {
  if (!extrema.answered()) return;
  extrema.extras.push_back({"neglected_phase_s", neglected_s, std::nullopt});
  if (std::abs(neglected_s) < *extrema.sigma_s) return;
  extrema.doubt(Verdict::weak, fmt::format("leaves out the phase that friction adds: about {:.0f} µs too small here",
                                           neglected_s * 1e6));
}

void name_streams(Estimate& e, const AngleStream& dial, const ImuStream& imu) {
  e.sensor = dial.name;
  e.reference = imu.name;
  e.frame_instant = "middle";
  e.frame_row = dial.timing.row == RowReference::first ? "first" : "middle";
}

void check_options(const PendulumOptions& options, const AngleStream& dial) {
  if (!(options.window_from_deg > options.window_to_deg) || options.window_to_deg < 0)
    throw std::invalid_argument(fmt::format("PendulumOptions: the window runs from {} to {} degrees; it must descend",
                                            options.window_from_deg, options.window_to_deg));
  if (options.estimate_line_delay && dial.rows.empty())
    throw std::invalid_argument("PendulumOptions: a line delay needs readings from several rows (AngleStream::rows)");
}

}  // namespace

Estimate calibrate_pendulum(const AngleStream& dial, const ImuStream& imu, const PendulumOptions& options) {
  check_options(options, dial);
  const auto refused = [&](const std::string& reason) {
    Estimate e = Estimate::refusal("spline", reason);
    name_streams(e, dial, imu);
    return e;
  };
  const Signals signals = prepare(dial, imu, options.estimate_line_delay);
  const Swings swings = signals.refusal.empty() ? find_swings(signals) : Swings{};
  if (const std::string why = refuse_motion(signals, swings); !why.empty()) return refused(why);
  const Coarse coarse = first_match(signals, swings);
  if (const std::string why = refuse_match(coarse); !why.empty()) return refused(why);
  const Window published = published_window(swings, options);
  if (published.swings.size() < fewest_swings)
    return refused(fmt::format("too few swings: {} of {} lie between {:g}° and {:g}° (--window)",
                               published.swings.size(), swings.all.size(), options.window_from_deg,
                               options.window_to_deg));
  Fitted found =
      fit_best_window(signals, swings, spline_windows(swings, published, options), coarse, options.estimate_line_delay);
  count_half_swings(found, signals, swings, options.estimate_line_delay);
  const SplineFit& fit = found.fit;

  const bool rolls = options.estimate_line_delay && fit.failure.empty();
  const Signals timed = rolls ? with_line_delay(signals, fit.line_delay_s) : signals;
  const Coarse near{rolls ? fit.delay_s : found.coarse.delay_s, found.coarse.scale, found.coarse.correlation};
  const std::vector<Swing> by_swing = rolls ? published_window(find_swings(timed), options).swings : published.swings;
  auto by_extrema = extrema_delays(timed, near, by_swing);
  auto by_damped = damped_delays(timed, near, by_swing);
  Estimate extrema = average("extrema", by_extrema, timed);
  Estimate damped = average("damped", by_damped, timed);
  Estimate result = from_spline(fit, signals, swings.period_s, options);
  warn_of_neglected_phase(extrema, neglected_phase_s(by_damped));
  for (Estimate* e : {&extrema, &damped})
    if (e->answered() && !published.note.empty()) e->doubt(Verdict::trusted, published.note);
  refuse_hand_moved(extrema, swings);
  refuse_hand_moved(damped, swings);
  doubt_conditions(result, signals, swings, found);
  for (Estimate* e : {&extrema, &damped}) share_doubt(result, *e);
  for (Estimate* e : {&extrema, &damped, &result}) name_streams(*e, dial, imu);

  result.extras.push_back({"period_s", swings.period_s, std::nullopt});
  const std::vector<Swing>& used = found.window.swings;
  result.extras.push_back({"swings", static_cast<double>(used.size()), std::nullopt});
  result.extras.push_back({"amplitude_from_rad", used.front().amplitude_rad, std::nullopt});
  result.extras.push_back({"amplitude_to_rad", used.back().amplitude_rad, std::nullopt});
  result.extras.push_back({"window_from_s", used.front().from_s, std::nullopt});
  result.extras.push_back({"window_to_s", used.back().to_s, std::nullopt});
  result.extras.push_back({"neglected_phase_s", neglected_phase_s(by_damped), std::nullopt});
  const Estimate alone = result;
  result.estimates = {alone, damped, extrema};
  if (fit.failure.empty()) result.evidence = evidence(fit, by_extrema, by_damped, swings);
  return result;
}

}  // namespace takt
