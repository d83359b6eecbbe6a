// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace takt {

/// A free-running oscillator: its phase against true time, second by second.
struct OscillatorModel {
  double offset_ppm = 0;       ///< of its frequency
  double drift_per_s = 0;      ///< steady ageing, 1/s
  double white_frequency = 0;  ///< q1, s²/s
  double walk_frequency = 0;   ///< q2, 1/s
  double thermal_ppm = 0;      ///< amplitude of a thermal cycle of the frequency
  double thermal_period_s = 3600;
  double ramp_ppm = 0;  ///< a ramp of the frequency over ramp_length_s, from ramp_start_s on
  double ramp_start_s = 0, ramp_length_s = 600;
};

/// "ocxo", "tcxo", "xo": as takt's bench assumes them (docs/methods/clock.md says on what grounds).
/// Throws std::invalid_argument for other names.
[[nodiscard]] OscillatorModel oscillator_model(const std::string& name);

/// Phase (s, device minus true) at true times 0, step_s, 2 step_s, …, `count` of them.
[[nodiscard]] std::vector<double> oscillator_phase(const OscillatorModel& model, std::size_t count, double step_s,
                                                   std::uint64_t seed);

/// How a receiver's pulses deviate from the true second.
struct PulseNoise {
  double white_s = 3.7e-9;  ///< σ of each pulse's own error
  double sawtooth_s = 0;    ///< period of the receiver's clock: the pulse is rounded to it; half is its bound
  bool corrected = true;    ///< the sawtooth is told (qErr) and can be taken off
  double wander_s = 0;      ///< σ of a slow wander (ionosphere, multipath)
  double wander_time_s = 600;
};
struct SimulatedPulse {
  double error_s = 0;  ///< of the pulse against the true second: late is positive
  double told_s = 0;   ///< what qErr says of it (rounded to ps); 0 without sawtooth
};
[[nodiscard]] std::vector<SimulatedPulse> pulse_errors(const PulseNoise& noise, std::size_t count, std::uint64_t seed);

}  // namespace takt
