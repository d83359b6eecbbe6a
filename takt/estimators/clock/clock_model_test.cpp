// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/clock_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/estimators/clock/allan.h"
#include "takt/estimators/clock/pps_clock.h"
#include "takt/simulation/oscillator.h"
#include "takt/simulation/random.h"

namespace takt {
namespace {

constexpr double tick = 1 / 48e6;

struct Recorded {
  std::vector<PhaseSample> samples;
  std::vector<double> half;  // true phase every half second
};
Recorded record(const std::string& oscillator, const PulseNoise& noise, std::size_t seconds, std::uint64_t seed) {
  Recorded out;
  OscillatorModel model = oscillator_model(oscillator);
  model.offset_ppm *= Random(seed, "beat").uniform(-2, 2);
  out.half = oscillator_phase(model, 2 * seconds + 2, 0.5, seed);
  const std::vector<SimulatedPulse> pulses = pulse_errors(noise, seconds, seed);
  for (std::size_t i = 0; i < seconds; ++i) {
    const double device = out.half[2 * i] + pulses[i].error_s;
    out.samples.push_back({static_cast<double>(i), (std::floor(device / tick) + 0.5) * tick - pulses[i].told_s});
  }
  return out;
}

struct Ahead {
  double squares = 0, nees = 0, n = 0;
};
/// Half a second ahead of each pulse from `from` on, as takt does it live: noise levels from the past alone.
void predict(const Recorded& r, std::size_t from, Ahead& out) {
  ClockFilter filter;
  for (std::size_t i = 16; i < r.samples.size(); ++i) {
    const std::span<const PhaseSample> past(r.samples.data(), i + 1);
    if (time_to_tune(i)) {
      filter.retune(fit_noise(past, tick));
      if (!filter.started()) {
        filter.start(past[0], rough_frequency(past), 1e-6);
        for (std::size_t k = 1; k < i; ++k) filter.observe(past[k]);
      }
    }
    filter.observe(past[i]);
    if (i < from) continue;
    const ClockPrediction p = filter.at(static_cast<double>(i) + 0.5);
    const double e = p.phase_s - r.half[2 * i + 1];
    out.squares += e * e, out.nees += e * e / p.phase_sigma_s / p.phase_sigma_s, out.n += 1;
  }
}

/// bench/accuracy/clock.cpp has the whole table over hours; here its two ends, shorter.
TEST(ClockModel, PredictsAheadWithHonestSigma) {
  const PulseNoise corrected{.white_s = 3.7e-9, .sawtooth_s = 19.1e-9, .corrected = true};
  const struct {
    const char* oscillator;
    double bar_ns;
  } rows[] = {{"tcxo", 5.5}, {"xo", 8.5}};
  for (const auto& row : rows) {
    Ahead a;
    for (std::uint64_t seed = 1; seed <= 2; ++seed) predict(record(row.oscillator, corrected, 2400, seed), 600, a);
    EXPECT_LT(1e9 * std::sqrt(a.squares / a.n), row.bar_ns) << row.oscillator;
    EXPECT_GT(a.nees / a.n, 0.7) << row.oscillator;
    EXPECT_LT(a.nees / a.n, 1.5) << row.oscillator;
  }
}

/// A wander of 500 s cannot be told from the oscillator's in two hours and a half: sigma has to say so. It is not quite
/// honest there (1.9 over twelve seeds, docs/methods/clock.md), but was 13 times too sure of itself without that.
TEST(ClockModel, AWanderThatIsNotToldApartWidensSigma) {
  const PulseNoise slow{.white_s = 4.5e-9, .corrected = false, .wander_s = 7.5e-9, .wander_time_s = 500};
  Ahead a;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) predict(record("ocxo", slow, 9000, seed), 3000, a);
  EXPECT_GT(a.nees / a.n, 0.5);
  EXPECT_LT(a.nees / a.n, 2.5);
}

TEST(ClockModel, ASlowWanderOfThePulsesIsNotTheOscillators) {
  const PulseNoise wandering{.white_s = 4.5e-9, .corrected = false, .wander_s = 7.5e-9, .wander_time_s = 40};
  const Recorded r = record("ocxo", wandering, 4000, 1);
  const ClockNoise noise = fit_noise(r.samples, tick);
  EXPECT_NEAR(1e9 * std::sqrt(noise.wander_s2), 7.5, 2.5);
}

TEST(ClockModel, AStepIsFollowed) {
  Recorded r = record("ocxo", {}, 400, 1);
  for (std::size_t i = 200; i < 400; ++i) r.samples[i].phase_s += 3e-6;
  const ClockNoise noise = fit_noise(std::span(r.samples).first(200), tick);
  const SmoothedClock s = smooth(r.samples, noise);
  EXPECT_NEAR(s.at[300].phase_s - r.half[600], 3e-6, 30e-9);
  EXPECT_NEAR(s.at[100].phase_s - r.half[200], 0, 30e-9);
}

TEST(Allan, WhitePhaseFallsWithTheAveragingTime) {
  Random random(1, "allan");
  std::vector<PhaseSample> s;
  for (int i = 0; i < 20000; ++i) s.push_back({static_cast<double>(i), 1e-8 * random.normal()});
  const std::vector<AllanPoint> a = allan_deviation(s);
  ASSERT_GE(a.size(), 8U);
  for (const AllanPoint& p : a) {
    if (p.tau_s > 500) continue;
    EXPECT_NEAR(p.deviation / (std::sqrt(3.0) * 1e-8 / p.tau_s), 1, 0.15) << p.tau_s;
  }
}

TEST(Holdover, SigmaCoversWhatTheOscillatorDoes) {
  double inside = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const PulseNoise corrected{.white_s = 3.7e-9, .sawtooth_s = 19.1e-9, .corrected = true};
    const Recorded r = record("tcxo", corrected, 3000, seed);
    const std::span<const PhaseSample> known(r.samples.data(), 2000);
    const ClockNoise noise = fit_noise(known, tick);
    const SmoothedClock s = smooth(known, noise);
    const std::vector<AllanPoint> allan = allan_deviation(known);
    ClockFilter filter(noise);
    filter.start(known[0], rough_frequency(known), 1e-6);
    for (std::size_t i = 1; i < known.size(); ++i) filter.observe(known[i]);
    for (const double t : {60.0, 300.0, 900.0}) {
      const double e = filter.at(1999 + t).phase_s - r.half[static_cast<std::size_t>(2 * (1999 + t))];
      all += 1;
      inside += std::abs(e) < 3 * holdover_sigma_s(s.at.back(), noise, t, allan);
    }
  }
  EXPECT_GE(inside / all, 0.97);
}

}  // namespace
}  // namespace takt
