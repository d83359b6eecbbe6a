// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/estimators/pendulum/signals.h"

namespace takt::pendulum {

/// A first guess to about a millisecond: where the gyro best matches the differences of the angle.
struct Coarse {
  double delay_s = 0;
  double scale = 0;        ///< gyro over angle rate; its sign is the mounting's
  double correlation = 0;  ///< normalised, of the best match: 0 to 1
};

/// Searches delays of up to ± `search_s`, either sign of the gyro.
[[nodiscard]] Coarse coarse_match(const Signals& signals, double search_s);

}  // namespace takt::pendulum
