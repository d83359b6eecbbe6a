// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/estimators/alignment/step_model.h"

/// What is expected of a recording's steps, measured over all of them.
namespace takt::alignment {

/// Lenses, misalignments and translation taken for rotation leave errors that grow with the turn. Measured where the
/// sensor turns most, beyond what is claimed for it there: variance per axis over the squared angle. `scale` is the
/// residuals' size in claimed sigmas, `before` what was allowed for when they were linearised.
[[nodiscard]] double relative_variance(const std::vector<Linear>& all, double scale, double before);

/// Rotation and sideways translation look alike in a narrow view, so what is usual of the parallax is worth much of the
/// information. Its spread includes the noise and whatever an offset not yet found has turned into parallax, so it
/// promises too little rather than too much.
[[nodiscard]] ParallaxExpectation expected_parallax(const std::vector<Linear>& all);

/// What of the parallax goes with the turning, v ≈ (R_from_to − I)·lever, as a share of the turn: a camera held at some
/// distance from where it turns about. That distance along the axis of a turn makes no difference.
[[nodiscard]] double parallax_with_turn(const std::vector<Linear>& all);

}  // namespace takt::alignment
