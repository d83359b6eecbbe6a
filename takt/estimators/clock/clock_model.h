// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

/// The two-clock model behind takt clock: a device's phase against a reference, seen through noise.
/// docs/methods/clock.md.
namespace takt {

/// Phase of the device at one instant: device minus reference, s.
struct PhaseSample {
  double t_s = 0;      ///< on the reference, since any start nearby
  double phase_s = 0;  ///< what was measured
};

/// Noise levels. The oscillator: white frequency, random-walk frequency and random-walk drift noise as spectral
/// densities; the measurement: white phase noise, and a slowly wandering part (first-order Gauss–Markov) that a
/// receiver's pulses have and an oscillator has not, for it stays bounded.
struct ClockNoise {
  double white_phase_s2 = 1e-16;   ///< variance of one measurement, s²
  double white_frequency = 1e-22;  ///< q1, s²/s
  double walk_frequency = 1e-26;   ///< q2, 1/s
  double walk_drift = 0;           ///< q3, 1/s³
  double wander_s2 = 0;            ///< variance of the pulses' own wander, s²; 0: none
  double wander_time_s = 300;      ///< its correlation time
  /// Variance of a wander that the data neither show nor rule out, by its odds: it blurs what is said of the phase.
  double unresolved_s2 = 0;
};

struct ClockPrediction {
  double phase_s = 0, frequency = 0, drift_per_s = 0;
  double phase_sigma_s = 0, frequency_sigma = 0;
  double phase_frequency_cov_s = 0;
};

/// Kalman filter of phase, frequency, drift and the pulses' wander. One pulse a step; gaps are steps of their length.
class ClockFilter {
 public:
  ClockFilter() : ClockFilter(ClockNoise{}) {}
  explicit ClockFilter(const ClockNoise& noise) : noise_(noise) {}

  /// Starts at a first sample; `frequency` is a first guess good to `frequency_sigma`.
  void start(const PhaseSample& first, double frequency, double frequency_sigma);
  [[nodiscard]] bool started() const { return started_; }
  /// Takes a sample, which must not be earlier than the one before. False where it is further off than `gate_sigmas`:
  /// it is left out then, unless several in a row were: then the clock has stepped, and the filter takes hold anew.
  bool observe(const PhaseSample& sample, double gate_sigmas = 6);
  [[nodiscard]] ClockPrediction at(double t_s) const;
  [[nodiscard]] double time_s() const { return t_s_; }
  /// The last sample's deviation from its prediction, and that deviation's variance.
  [[nodiscard]] double innovation_s() const { return innovation_; }
  [[nodiscard]] double innovation_var_s2() const { return innovation_var_; }
  /// Continues from here with other noise levels.
  void retune(const ClockNoise& noise) { noise_ = noise; }
  [[nodiscard]] const ClockNoise& noise() const { return noise_; }
  /// A step of phase or frequency has happened: the state keeps its values, but not its certainty.
  void loosen(double phase_sigma_s, double frequency_sigma);

  using State = Eigen::Vector4d;
  using Covariance = Eigen::Matrix4d;
  [[nodiscard]] const State& state() const { return z_; }
  [[nodiscard]] const Covariance& covariance() const { return p_; }
  /// Before the last sample was taken in.
  [[nodiscard]] const State& prior_state() const { return z_prior_; }
  [[nodiscard]] const Covariance& prior_covariance() const { return p_prior_; }
  /// The step of `dt_s` and what it adds to the covariance.
  [[nodiscard]] static Eigen::Matrix4d transition(const ClockNoise& noise, double dt_s);
  [[nodiscard]] static Eigen::Matrix4d process(const ClockNoise& noise, double dt_s);

 private:
  ClockNoise noise_;
  State z_ = State::Zero();
  Covariance p_ = Covariance::Zero();
  State z_prior_ = State::Zero();
  Covariance p_prior_ = Covariance::Zero();
  double t_s_ = 0;
  double innovation_ = 0, innovation_var_ = 0;
  std::size_t rejected_ = 0;  // in a row
  bool started_ = false;
};

/// When a live filter should find its noise levels anew: often while it knows little, later each 4096 pulses.
[[nodiscard]] constexpr bool time_to_tune(std::size_t pulses) {
  const bool doubled = pulses >= 16 && (pulses & (pulses - 1)) == 0;
  return pulses <= 4096 ? doubled : pulses % 4096 == 0;
}

/// Robust first guess of the frequency: the median of differences over a few samples.
[[nodiscard]] double rough_frequency(std::span<const PhaseSample> samples);

/// Noise levels by maximum likelihood of the innovations. `quantum_s`: the counter's tick, whose rounding is the least
/// noise there can be. At most `most` samples, the last ones, are used.
[[nodiscard]] ClockNoise fit_noise(std::span<const PhaseSample> samples, double quantum_s, std::size_t most = 8192);
/// −log likelihood of the samples.
[[nodiscard]] double noise_cost(std::span<const PhaseSample> samples, const ClockNoise& noise);

/// The filter forward, then Rauch–Tung–Striebel backward: what is known of every instant from all samples.
/// Samples that fail the gate are left out; `used` says which.
struct SmoothedClock {
  std::vector<ClockPrediction> at;
  std::vector<char> used;
  std::vector<double> innovations_s;  ///< one a sample, against the forward prediction
};
/// A sample whose phase is NaN asks for an instant without adding to what is known.
/// `slips` are indices before which the phase is known to have stepped.
[[nodiscard]] SmoothedClock smooth(std::span<const PhaseSample> samples, const ClockNoise& noise,
                                   std::span<const std::size_t> slips = {});

}  // namespace takt
