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
  int band = -1;  ///< −1: the whole frame
};

/// Light from the mean over the frames, smoothed so far that no graduation is left in it.
[[nodiscard]] std::vector<float> smooth_light(const std::vector<const Profile*>& profiles,
                                              const std::vector<Slot>& slots);

/// Light of each slot, once the patterns and the readings are known. Slots that always saw the same keep theirs.
void refine_light(SlotMap& map, const std::vector<Placed>& frames, const Patterns& patterns);

/// Corrects the slots' angles to what the patterns say: α += k1·α + k2·α² + k3·α³ + (k4 + k5·α)·h, the lowest orders of
/// wrong focal length or distance, yaw, lens, roll and pitch. Each frame's reading and brightness stay free.
/// Only slots within `reach_rad` of the axis count, and near the axis k1 alone can be told. Returns k1.
double refine_angles(SlotMap& map, const std::vector<Placed>& frames, const Patterns& patterns, double reach_rad,
                     bool scale_alone);

/// The dial as all frames together show it. Where no frame has looked it is `before`.
[[nodiscard]] Patterns mosaic(const SlotMap& map, const std::vector<Placed>& frames, const Patterns& before);

/// The dial as one frame shows it.
[[nodiscard]] Patterns single_view(const SlotMap& map, const Profile& profile, double reading_rad, double step_rad,
                                   std::size_t levels);

}  // namespace takt::dial
