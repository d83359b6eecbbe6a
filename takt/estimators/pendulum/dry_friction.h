// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/motion/pendulum.h"

namespace takt::pendulum {

/// The part of a swing that dry friction of unit strength leaves behind and no spline can follow: its acceleration is
/// −1 while the angle grows, +1 while it falls, and jumps at each reversal. Between two reversals it is the parabola
/// that vanishes at both; as half swings are equally long to 1e-4, its slope is continuous too.
class DryFriction {
 public:
  DryFriction() = default;
  /// `reversals` ascend; `first_rising`: the angle grows between the first and the second.
  DryFriction(std::vector<double> reversals, bool first_rising)
      : reversals_(std::move(reversals)), first_rising_(first_rising) {}

  [[nodiscard]] bool empty() const { return reversals_.size() < 2; }
  [[nodiscard]] PendulumState at(double t) const;

 private:
  std::vector<double> reversals_;
  bool first_rising_ = true;
};

}  // namespace takt::pendulum
