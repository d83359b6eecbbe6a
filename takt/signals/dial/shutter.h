// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/signals/dial/follow.h"

/// What a rolling shutter does to the dial: row y shows it y line delays later, so that a moving dial is sheared by its
/// speed times the line delay. In a rolled camera the rows run across the dial, and the shear stretches it too.
namespace takt::dial {

/// Of the dial at each frame, from the readings beside it.
struct DialMotion {
  double speed_rad_s = 0;
  double acceleration_rad_s2 = 0;  ///< 0 where a neighbour is missing
};
/// Nothing where there are no readings beside a frame.
[[nodiscard]] std::vector<std::optional<DialMotion>> motion_of(const Film& film, const Readings& readings);

/// shear = constant + line delay·speed over all frames that moved; what is constant is mounting, not shutter.
struct ShearLine {
  double constant_rad = 0;  ///< a row
  double line_delay_s = 0;
};
[[nodiscard]] ShearLine line_through_shears(const Readings& readings,
                                            const std::vector<std::optional<DialMotion>>& motion);

}  // namespace takt::dial
