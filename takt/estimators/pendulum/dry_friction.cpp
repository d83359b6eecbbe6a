// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/pendulum/dry_friction.h"

#include <algorithm>

namespace takt::pendulum {

PendulumState DryFriction::at(double t) const {
  if (empty()) return {};
  // The half swing of t; before the first and after the last the neighbour's parabola and its mirror go on.
  const auto after = std::upper_bound(reversals_.begin(), reversals_.end(), t) - reversals_.begin();
  const auto n = static_cast<std::ptrdiff_t>(reversals_.size());
  double from = 0, to = 0;
  if (after == 0) {
    to = reversals_[0];
    from = to - (reversals_[1] - reversals_[0]);
  } else if (after == n) {
    from = reversals_.back();
    to = from + (reversals_[reversals_.size() - 1] - reversals_[reversals_.size() - 2]);
  } else {
    from = reversals_[static_cast<std::size_t>(after - 1)];
    to = reversals_[static_cast<std::size_t>(after)];
  }
  const bool rising = (after % 2 == 1) == first_rising_;
  const double sign = rising ? -1 : 1;
  return {sign * 0.5 * (t - from) * (t - to), sign * (t - 0.5 * (from + to)), sign};
}

}  // namespace takt::pendulum
