// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/signals/dial/pattern.h"
#include "takt/signals/dial/rectifier.h"

namespace takt::dial {

/// What is known of the slots, the same for all frames.
struct SlotMap {
  std::vector<Slot> slots;   ///< angles as corrected by the dial itself
  std::vector<float> light;  ///< what vignetting leaves of each
};

/// Which slots take part.
struct Part {
  int band = -1;         ///< −1: all
  double reach_rad = 9;  ///< only slots within it of the optical axis
};

struct Registration {
  double reading_rad = 0;
  double sigma_rad = 0;    ///< from the residuals
  double correlation = 0;  ///< of the frame with the pattern, −1 … 1
  double gain = 0, level = 0;
  double row = 0;  ///< where the reading was taken: mean of the slots' rows, each by its share in the reading
};

/// Sub-pixel maximum of the likelihood near a first guess (within a line's width): least squares in the reading, the
/// brightness and the contrast, grey = light·(gain·pattern(reading + angle) + level).
[[nodiscard]] Registration register_profile(const Profile& profile, const SlotMap& map, const Patterns& patterns,
                                            double guess_rad, const Part& part = {});

/// The best of the readings from `from` to `to`, a pixel apart, by correlation; nothing to register to gives 0.
struct Candidate {
  double reading_rad = 0, correlation = -1;
};
[[nodiscard]] Candidate search_reading(const Profile& profile, const SlotMap& map, const Patterns& patterns,
                                       double from_rad, double to_rad, double step_rad, const Part& part = {});

}  // namespace takt::dial
