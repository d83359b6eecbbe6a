// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/matched_stamps.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "takt/estimators/clock/clock_model.h"
#include "takt/math/median.h"

namespace takt {

namespace {

constexpr std::size_t least_matches = 16;
constexpr std::size_t most_pieces = 64;

}  // namespace

Estimate relate_matches(std::span<const MatchedStamps> m, const std::string& sensor, const std::string& reference) {
  Estimate e =
      Estimate::refusal("kalman", fmt::format("{} matched stamps; at least {} are needed", m.size(), least_matches));
  e.sensor = sensor;
  e.reference = reference;
  if (m.size() < least_matches) return e;
  // Reference less sensor, against the first: small numbers, exact.
  const std::int64_t origin = m.front().sensor_ns, offset = m.front().reference_ns - origin;
  std::vector<PhaseSample> samples;
  for (const MatchedStamps& x : m) {
    const double t = 1e-9 * static_cast<double>(x.sensor_ns - origin);
    if (!samples.empty() && t <= samples.back().t_s) continue;
    samples.push_back({t, 1e-9 * static_cast<double>(x.reference_ns - x.sensor_ns - offset)});
  }
  if (samples.size() < least_matches) return e;
  const ClockNoise noise = fit_noise(samples, 1e-9);
  const SmoothedClock clock = smooth(samples, noise);
  const auto piece = [&](std::size_t i, std::size_t j) {
    OffsetPiece p;
    p.epoch = p.start = from_ns(origin + std::llround(1e9 * samples[i].t_s));
    p.offset = Duration(offset + std::llround(1e9 * clock.at[i].phase_s));
    p.drift =
        j > i ? (clock.at[j].phase_s - clock.at[i].phase_s) / (samples[j].t_s - samples[i].t_s) : clock.at[i].frequency;
    for (std::size_t k = i; k <= j; ++k) p.sigma_s = std::max({p.sigma_s, clock.at[k].phase_sigma_s, 0.3e-9});
    return p;
  };
  const std::size_t middle = samples.size() / 2, last = samples.size() - 1;
  const OffsetPiece here = piece(middle, middle);
  e = {};
  e.method = "kalman";
  e.sensor = sensor;
  e.reference = reference;
  e.verdict = Verdict::trusted;
  e.epoch = here.epoch;
  e.offset = here.offset;
  e.sigma_s = here.sigma_s;
  e.drift = here.drift;
  e.drift_sigma = clock.at[middle].frequency_sigma;
  double bend = 0;
  for (std::size_t i = 0; i < samples.size(); ++i)
    bend = std::max(bend, std::abs(clock.at[i].phase_s - clock.at[middle].phase_s -
                                   clock.at[middle].frequency * (samples[i].t_s - samples[middle].t_s)) -
                              3 * clock.at[i].phase_sigma_s);
  if (bend > 0) {
    const std::size_t pieces = std::clamp<std::size_t>(samples.size() / 16, 1, most_pieces);
    for (std::size_t k = 0; k < pieces; ++k) e.pieces.push_back(piece(k * last / pieces, (k + 1) * last / pieces));
  }
  Panel panel;
  panel.name = "residuals";
  panel.kind = "points";
  panel.title = "Matched stamps against the smoothed clock";
  panel.caption = "What is left of each event.";
  panel.x = {"time", "s", {}, {}, {}};
  Series y{"residual", "s", {}, {}, {}};
  const std::size_t step = std::max<std::size_t>(1, samples.size() / 5000);
  for (std::size_t i = 0; i < samples.size(); i += step) {
    panel.x.values.push_back(samples[i].t_s);
    y.values.push_back(clock.used[i] ? samples[i].phase_s - clock.at[i].phase_s : std::nan(""));
  }
  panel.y.push_back(std::move(y));
  e.evidence.panels = {panel};
  std::size_t outliers = 0;
  for (const char used : clock.used) outliers += !used;
  e.extras.push_back({"matched", static_cast<double>(samples.size()), {}});
  e.extras.push_back({"outliers", static_cast<double>(outliers), {}});
  e.extras.push_back({"stamp_noise_s", std::sqrt(noise.white_phase_s2), {}});
  if (outliers * 10 > samples.size())
    e.doubt(Verdict::weak, fmt::format("{} of {} matched stamps do not fit one clock", outliers, samples.size()));
  return e;
}

ExposureSync exposure_sync(std::span<const StrobeStream> strobes, std::span<const PulseStream> triggers) {
  ExposureSync out;
  std::vector<double> exposures, delays;
  for (std::size_t c = 0; c < std::min(strobes.size(), triggers.size()); ++c) {
    const double hz = strobes[c].counter.tick_hz;
    std::vector<double> exposure, delay;
    double sum = 0, squares = 0;
    std::size_t t = 0;
    const std::vector<Pulse>& pulses = triggers[c].pulses;
    for (const FrameStrobe& s : strobes[c].strobes) {
      while (t + 1 < pulses.size() && pulses[t + 1].ticks <= s.start_ticks) ++t;
      if (pulses.empty() || pulses[t].ticks > s.start_ticks) continue;
      exposure.push_back(static_cast<double>(s.end_ticks - s.start_ticks) / hz);
      delay.push_back(static_cast<double>(s.start_ticks - pulses[t].ticks) / hz);
      const double middle = delay.back() + 0.5 * exposure.back();
      sum += middle, squares += middle * middle;
    }
    if (exposure.empty()) continue;
    ExposureSync::Camera& camera = out.cameras.emplace_back();
    camera.name = strobes[c].name;
    camera.frames = exposure.size();
    const auto n = static_cast<double>(camera.frames);
    camera.middle_s = sum / n;
    camera.middle_scatter_s = std::sqrt(std::max(0.0, squares / n - camera.middle_s * camera.middle_s));
    exposures.push_back(camera.exposure_s = median(std::move(exposure)));
    delays.push_back(camera.delay_s = median(std::move(delay)));
  }
  const std::vector<double> when = compensated_triggers(0, exposures, delays);
  const double first_middle_s = out.cameras.empty() ? 0 : out.cameras.front().middle_s;
  for (std::size_t c = 0; c < out.cameras.size(); ++c) {
    out.cameras[c].middle_s -= first_middle_s;
    out.cameras[c].advance_s = when.front() - when[c];
  }
  return out;
}

}  // namespace takt
