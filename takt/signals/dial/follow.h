// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/signals/dial/film.h"
#include "takt/signals/dial/registration.h"

/// From frame to frame: a reading for each, or nothing where the dial was not recognised.
namespace takt::dial {

using Readings = std::vector<std::optional<Registration>>;

/// Below it a frame does not show the pattern.
inline constexpr double least_correlation = 0.6;

/// One frame anywhere on patterns that look nowhere the same; by the middle of the view first, where a wrong scale does
/// least.
[[nodiscard]] Registration search_anywhere(const Profile& profile, const SlotMap& map, const Patterns& patterns,
                                           double pixel_rad, const Part& part);

/// Each frame against the one before (`keep_frames` false), or against the nearest of a few kept ones. The first frame
/// reads 0.
[[nodiscard]] Readings follow_frames(const Film& film, const SlotMap& map, std::size_t strips, double pixel_rad,
                                     bool keep_frames, const Part& part);

/// Each frame against patterns that look nowhere the same: near where the motion should have come, else anywhere.
[[nodiscard]] Readings follow_code(const Film& film, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                                   const Part& part);

/// Each frame near `chain` plus what the frame before was away from it; the first is sought within `range_rad` of
/// `chain` + `offset_rad`.
[[nodiscard]] Readings follow_chain(const Film& film, const SlotMap& map, const Patterns& patterns, double pixel_rad,
                                    const Readings& chain, double offset_rad, double range_rad, const Part& part);

}  // namespace takt::dial
