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
  double pivot_row = 0;      ///< the row at which a frame's reading is taken: the mean over the pixels
};

/// Which slots take part, and what is free.
struct Part {
  double reach_rad = 9;     ///< only slots within it of the optical axis
  bool free_shear = false;  ///< the rows have an instant each: the reading's change from row to row is found too
};

/// Where a frame is placed: row y, x = y − pivot row, shows the reading + shear·x + bend·x²/2.
struct Placement {
  double reading_rad = 0;
  double shear_rad = 0;  ///< a row: the dial's speed times the line delay
  double bend_rad = 0;   ///< a row squared: its acceleration times the line delay squared

  [[nodiscard]] double shift_rad(double rows) const { return (shear_rad + 0.5 * bend_rad * rows) * rows; }
  [[nodiscard]] double angle_of(const Slot& slot, double pivot_row) const {
    return reading_rad + slot.angle_rad + shift_rad(slot.row - pivot_row);
  }
};

struct Registration : Placement {
  double sigma_rad = 0, shear_sigma_rad = 0;  ///< from the residuals
  double correlation = 0;                     ///< of the frame with the pattern, −1 … 1
  double gain = 0, level = 0;
};

/// Sub-pixel maximum of the likelihood near a first guess (within a line's width): least squares in the reading, the
/// brightness and the contrast (and the shear), grey = light·(gain·pattern(angle) + level).
[[nodiscard]] Registration register_profile(const Profile& profile, const SlotMap& map, const Patterns& patterns,
                                            const Placement& guess, const Part& part = {});

struct Candidate {
  double reading_rad = 0, correlation = -1;
};
/// Readings from `from` to `to`, `step` apart, that correlate better than their neighbours do and nearly as well as the
/// best (between two steps a line's correlation falls by a tenth), the best one first; none where there is nothing to
/// register to.
[[nodiscard]] std::vector<Candidate> search_readings(const Profile& profile, const SlotMap& map,
                                                     const Patterns& patterns, double from_rad, double to_rad,
                                                     double step_rad, double shear_rad, const Part& part = {});

}  // namespace takt::dial
