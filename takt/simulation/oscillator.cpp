// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/oscillator.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "takt/simulation/random.h"

namespace takt {

OscillatorModel oscillator_model(const std::string& name) {
  OscillatorModel m;
  if (name == "ocxo") {
    m.offset_ppm = 0.0153;
    m.white_frequency = 1e-22;
    m.walk_frequency = 1.5e-25;
  } else if (name == "tcxo") {
    m.offset_ppm = 0.8;
    m.white_frequency = 1e-20;
    m.walk_frequency = 1e-22;
    m.thermal_ppm = 0.2;
  } else if (name == "xo") {
    m.offset_ppm = 12;
    m.white_frequency = 1e-19;
    m.walk_frequency = 1e-20;
    m.thermal_ppm = 3;
  } else {
    throw std::invalid_argument("oscillator: \"" + name + "\" is none of ocxo, tcxo, xo");
  }
  return m;
}

std::vector<double> oscillator_phase(const OscillatorModel& m, std::size_t count, double step_s, std::uint64_t seed) {
  Random random(seed, "oscillator");
  const double omega = 2 * std::numbers::pi / m.thermal_period_s, start = random.uniform(0, 2 * std::numbers::pi);
  std::vector<double> out(count);
  double walk = 0, phase = 0;
  const auto ramp_integral = [&](double t) {
    const double u = std::min(std::max(t - m.ramp_start_s, 0.0), m.ramp_length_s);
    return m.ramp_ppm * 1e-6 * (0.5 * u * u / m.ramp_length_s + std::max(t - m.ramp_start_s - m.ramp_length_s, 0.0));
  };
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) * step_s;
    // The deterministic part in closed form, so that long runs gather no rounding.
    const double thermal = m.thermal_ppm * 1e-6 * (std::cos(start) - std::cos(omega * t + start)) / omega;
    out[i] = m.offset_ppm * 1e-6 * t + 0.5 * m.drift_per_s * t * t + thermal + ramp_integral(t) + phase;
    // White and random-walk frequency noise over the next step, with the walk's own integral.
    const double step = std::sqrt(m.walk_frequency * step_s) * random.normal();
    phase += walk * step_s + 0.5 * step * step_s +
             std::sqrt(m.walk_frequency * step_s * step_s * step_s / 12) * random.normal() +
             std::sqrt(m.white_frequency * step_s) * random.normal();
    walk += step;
  }
  return out;
}

std::vector<SimulatedPulse> pulse_errors(const PulseNoise& n, std::size_t count, std::uint64_t seed) {
  Random random(seed, "pulses");
  std::vector<SimulatedPulse> out(count);
  double wander = n.wander_s * random.normal();
  const double keep = std::exp(-1 / n.wander_time_s);
  // The receiver's own crystal runs off by an odd amount: the pulse falls on the nearest of its edges.
  double receiver = random.uniform();
  double slip = random.uniform(0.05, 0.45);
  for (SimulatedPulse& p : out) {
    p.error_s = n.white_s * random.normal() + wander;
    if (n.sawtooth_s > 0) {
      slip += 1e-3 * random.normal();
      receiver += slip;
      receiver -= std::floor(receiver);
      const double rounding = n.sawtooth_s * (receiver - 0.5);
      p.error_s += rounding;
      p.told_s = n.corrected ? std::round(rounding * 1e12) * 1e-12 : 0;
    }
    wander = keep * wander + n.wander_s * std::sqrt(1 - keep * keep) * random.normal();
  }
  return out;
}

}  // namespace takt
