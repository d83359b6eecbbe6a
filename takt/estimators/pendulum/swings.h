// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/estimators/pendulum/signals.h"

namespace takt::pendulum {

/// One full period of the angle, from an upward passage through rest to the next, on the camera's clock.
struct Swing {
  double from_s = 0;
  double to_s = 0;
  double amplitude_rad = 0;  ///< half of highest − lowest

  [[nodiscard]] double middle_s() const { return 0.5 * (from_s + to_s); }
  [[nodiscard]] double period_s() const { return to_s - from_s; }
};

struct Swings {
  std::vector<Swing> all;
  double rest_rad = 0;       ///< reading half way between the extremes
  double period_s = 0;       ///< median
  double amplitude_rad = 0;  ///< the largest
  bool free = false;         ///< amplitudes never grow and periods agree: nothing but gravity and friction at work
  std::string not_free;      ///< what contradicts that, in words
};

/// Finds the swings; a swing with a gap longer than a quarter of it is left out.
[[nodiscard]] Swings find_swings(const Signals& signals);

/// Those with an amplitude in [to_rad, from_rad].
[[nodiscard]] std::vector<Swing> within(const std::vector<Swing>& swings, double from_rad, double to_rad);

}  // namespace takt::pendulum
