// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/signals/dial/registration.h"

/// What the frames themselves tell of the slots and of the dial.
namespace takt::dial {

/// One frame's part in it.
struct Placed {
  const Profile* profile;
  Registration at;
  double speed_rad_s = 0;  ///< of the dial; matters to a rolling shutter only
};

/// Light from the mean over the frames, smoothed so far that no graduation is left in it.
[[nodiscard]] std::vector<float> smooth_light(const std::vector<const Profile*>& profiles,
                                              const std::vector<Slot>& slots);

/// Light of each slot, once the patterns and the readings are known. Slots that always saw the same keep theirs.
void refine_light(SlotMap& map, const std::vector<Placed>& frames, const Patterns& patterns);

/// What `refine_angles` is to find besides each frame's reading and brightness, which stay free.
struct Freedom {
  double reach_rad;         ///< only slots within it of the axis count
  bool scale_alone;         ///< near the axis k1 alone can be told
  bool line_delay = false;  ///< what the rows of moving frames are apart
};
struct Correction {
  double scale = 0;         ///< k1
  double line_delay_s = 0;  ///< to be added to what the frames' shears were made from
};
/// Corrects the slots' angles to what the patterns say: α += k1·α + k2·α² + k3·α³ + (k4 + k5·α)·h, the lowest orders of
/// wrong focal length or distance, yaw, lens, roll and pitch.
Correction refine_angles(SlotMap& map, const std::vector<Placed>& frames, const Patterns& patterns,
                         const Freedom& freedom);

/// The dial as all frames together show it. Where no frame has looked it is `before`. A strip's tilt is right where the
/// dial went both ways: what one frame's own shear adds to it has the sign of the speed.
[[nodiscard]] Patterns mosaic(const SlotMap& map, const std::vector<Placed>& frames, const Patterns& before);

/// The dial as one frame shows it.
[[nodiscard]] Patterns single_view(const SlotMap& map, const Profile& profile, const Placement& at, double step_rad,
                                   std::size_t strips);

}  // namespace takt::dial
