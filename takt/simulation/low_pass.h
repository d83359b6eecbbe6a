// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/motion/rotation.h"

namespace takt {

/// The digital low-pass inside an IMU. Only `fir` delays all frequencies alike; the others' delay is that of slow
/// motion (their phase's slope at 0 Hz).
enum class LowPassKind { none, first_order, second_order, fir };

/// A digital filter at a fixed rate: a[0]·y[n] = Σ b[i]·x[n−i] − Σ a[i]·y[n−i], gain 1 at 0 Hz.
class LowPass {
 public:
  /// −3 dB at `bandwidth_hz` (first order: exponential; second: Butterworth by the bilinear transform; fir: Hamming
  /// window, whose length the bandwidth sets).
  LowPass(LowPassKind kind, double bandwidth_hz, double rate_hz);

  /// Group delay at 0 Hz (s).
  [[nodiscard]] double delay_s() const;
  /// How long the past still matters (s), to 1e-12: what to run in before the first output.
  [[nodiscard]] double memory_s() const;
  /// The next output.
  Vec3 step(const Vec3& x);

 private:
  double rate_hz_;
  std::vector<double> b_, a_;
  std::vector<Vec3> x_, y_;  // newest first
};

}  // namespace takt
