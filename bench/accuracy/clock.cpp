// SPDX-License-Identifier: Apache-2.0
// accuracy_clock [hours]: a 1PPS on a 48 MHz counter, predicted 0.5 s ahead; rms in ns, mean removed.
#include <fmt/core.h>

#include <cmath>
#include <cstdlib>

#include "takt/estimators/clock/clock_model.h"
#include "takt/simulation/oscillator.h"
#include "takt/simulation/random.h"

namespace {

using namespace takt;

struct Input {
  const char* name;
  const char* oscillator;
  PulseNoise pulses;
  double bar_ns;
};

/// Prediction errors (s) at pulse + 0.5 s, and the estimator's own σ.
struct Run {
  std::vector<double> error, sigma;
};

double rms_ns(const std::vector<double>& e) {
  double sum = 0, squares = 0;
  for (const double x : e) sum += x;
  const double mean = sum / static_cast<double>(e.size());
  for (const double x : e) squares += (x - mean) * (x - mean);
  return 1e9 * std::sqrt(squares / static_cast<double>(e.size()));
}

double line_ahead(const std::vector<PhaseSample>& s, std::size_t last, std::size_t n) {
  double st = 0, sx = 0, stt = 0, stx = 0;
  for (std::size_t i = last + 1 - n; i <= last; ++i) {
    const double t = s[i].t_s - s[last].t_s, x = s[i].phase_s - s[last].phase_s;
    st += t, sx += x, stt += t * t, stx += t * x;
  }
  const double m = static_cast<double>(n), slope = (m * stx - st * sx) / (m * stt - st * st);
  return s[last].phase_s + (sx - slope * st) / m + 0.5 * slope;
}

void row(const Input& input, std::size_t seconds, std::uint64_t seeds) {
  const std::size_t warm_up = seconds / 4;
  std::vector<double> last2, lin16, lin64, lin256, kalman, nees;
  const auto add = [](std::vector<double>& all, std::vector<double> e) {
    double mean = 0;
    for (const double x : e) mean += x / static_cast<double>(e.size());
    for (const double x : e) all.push_back(x - mean);
  };
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    OscillatorModel oscillator = oscillator_model(input.oscillator);
    // The beat between counter and second decides how the rounding averages out, so each run has its own.
    oscillator.offset_ppm *= Random(seed, "beat").uniform(-2, 2);
    const std::vector<double> half = oscillator_phase(oscillator, 2 * seconds + 2, 0.5, seed);
    const std::vector<SimulatedPulse> pulses = pulse_errors(input.pulses, seconds, seed);
    std::vector<PhaseSample> s(seconds);
    const double tick = 1 / 48e6;
    for (std::size_t i = 0; i < seconds; ++i) {
      // Phase now, at a pulse that is off by nanoseconds: the oscillator has not moved meanwhile.
      const double device = pulses[i].error_s + half[2 * i];
      s[i] = {static_cast<double>(i), std::floor(device / tick) * tick + 0.5 * tick - pulses[i].told_s};
    }
    ClockFilter filter;
    Run r2, r16, r64, r256, rk;
    for (std::size_t i = 0; i < seconds; ++i) {
      const std::span<const PhaseSample> past(s.data(), i + 1);
      // As takt clock does it live: noise levels from the past alone, found anew at every doubling and each 4096
      // pulses.
      const bool tune = time_to_tune(i);
      if (i < 16) continue;
      if (tune) {
        filter.retune(fit_noise(past, tick));
        if (!filter.started()) {
          filter.start(s[0], rough_frequency(past), 1e-6);
          for (std::size_t k = 1; k < i; ++k) filter.observe(s[k]);
        }
      }
      filter.observe(s[i]);
      if (i < warm_up || 2 * i + 1 >= half.size()) continue;
      const double truth = half[2 * i + 1];
      r2.error.push_back(1.5 * s[i].phase_s - 0.5 * s[i - 1].phase_s - truth);
      r16.error.push_back(line_ahead(s, i, 16) - truth);
      r64.error.push_back(line_ahead(s, i, 64) - truth);
      r256.error.push_back(line_ahead(s, i, 256) - truth);
      const ClockPrediction p = filter.at(static_cast<double>(i) + 0.5);
      rk.error.push_back(p.phase_s - truth);
      nees.push_back((p.phase_s - truth) * (p.phase_s - truth) / (p.phase_sigma_s * p.phase_sigma_s));
    }
    const ClockNoise& n = filter.noise();
    if (seed == 1 && std::getenv("VERBOSE"))
      fmt::print("   R {:.2f} ns q1 {:.1e} q2 {:.1e} q3 {:.1e} wander {:.2f} ns {:.0f} s  sigma {:.2f}\n",
                 1e9 * std::sqrt(n.white_phase_s2), n.white_frequency, n.walk_frequency, n.walk_drift,
                 1e9 * std::sqrt(n.wander_s2), n.wander_time_s, 1e9 * filter.at(filter.time_s() + 0.5).phase_sigma_s);
    add(last2, r2.error), add(lin16, r16.error), add(lin64, r64.error), add(lin256, r256.error), add(kalman, rk.error);
  }
  double mean_nees = 0;
  for (const double x : nees) mean_nees += x / static_cast<double>(nees.size());
  fmt::print("{:<36} {:7.1f} {:7.1f} {:7.1f} {:8.1f} {:7.2f}  {:5.1f}  {:5.2f}\n", input.name, rms_ns(last2),
             rms_ns(lin16), rms_ns(lin64), rms_ns(lin256), rms_ns(kalman), input.bar_ns, mean_nees);
}

}  // namespace

int main(int argc, char** argv) {
  const double hours = argc > 1 ? std::atof(argv[1]) : 4;
  const std::uint64_t seeds = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 4;
  const PulseNoise sawtooth{.white_s = 3.7e-9, .sawtooth_s = 19.1e-9, .corrected = false};
  const PulseNoise corrected{.white_s = 3.7e-9, .sawtooth_s = 19.1e-9, .corrected = true};
  const auto wandering = [](double time_s) {
    return PulseNoise{
        .white_s = 4.5e-9, .sawtooth_s = 0, .corrected = false, .wander_s = 7.5e-9, .wander_time_s = time_s};
  };
  fmt::print("{:<36} {:>7} {:>7} {:>7} {:>8} {:>7}  {:>5}  {:>5}\n", "oscillator / PPS", "last 2", "lin16", "lin64",
             "lin256", "takt", "bar", "NEES");
  const auto seconds = static_cast<std::size_t>(3600 * hours);
  row({"OCXO / sawtooth", "ocxo", sawtooth, 1.1}, seconds, seeds);
  row({"OCXO / qErr-corrected", "ocxo", corrected, 0.8}, seconds, seeds);
  row({"OCXO / 1PPS wandering over 40 s", "ocxo", wandering(40), 6.7}, seconds, seeds);
  row({"OCXO / 1PPS wandering over 150 s", "ocxo", wandering(150), 0}, seconds, seeds);
  row({"OCXO / 1PPS wandering over 500 s", "ocxo", wandering(500), 0}, seconds, seeds);
  row({"OCXO / 1PPS wandering over 1500 s", "ocxo", wandering(1500), 0}, seconds, seeds);
  row({"TCXO / qErr-corrected", "tcxo", corrected, 5.5}, seconds, seeds);
  row({"XO / qErr-corrected", "xo", corrected, 8.5}, seconds, seeds);
}
