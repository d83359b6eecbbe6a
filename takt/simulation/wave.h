// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "takt/motion/rotation.h"
#include "takt/simulation/random.h"

namespace takt {

/// The band that a wave fills. `rms` is that of its first derivative: what a gyro or a speedometer feels.
struct Band {
  double rms = 0;  ///< of the derivative's length, over all time
  double low_hz = 0.1;
  double high_hz = 1;
  int tones = 24;
};

/// A smooth, band-limited vector function of time with closed-form derivatives, defined for all times:
///   Σ_k e_k(t)·d_k·sin(2π f_k t + φ_k)
/// The envelopes e_k are quintic B-splines through seeded random values, so the wave never repeats itself:
/// a bare sum of sinusoids nearly does, and a search over half an hour would find it. A single tone keeps e = 1.
class Wave {
 public:
  /// Nothing moves.
  Wave() = default;
  /// Tones in random directions, each mapped by `shape`: identity for all directions alike, a·aᵀ for one axis.
  Wave(const Band& band, const Mat3& shape, Random random);

  /// Value, first and second derivative.
  [[nodiscard]] std::array<Vec3, 3> at(double t_s) const;
  /// No component ever exceeds these.
  [[nodiscard]] Vec3 bound() const;

 private:
  struct Tone {
    double omega, phase;
    Vec3 amplitude;
    std::uint64_t envelope_seed;
  };
  std::vector<Tone> tones_;
};

}  // namespace takt
