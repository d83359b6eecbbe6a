// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/estimators/alignment/problem.h"

namespace takt::alignment {

/// Log of the true focal length over the assumed one, from how much the picture turned sideways and up against how much
/// the gyro did. (About the optical axis both agree whatever the focal length.) The bearings' own epipolar geometry is
/// no help: a longer focal length makes every displacement look more like a translation.
[[nodiscard]] double fit_log_focal(const Problem& problem, const Coarse& start);

}  // namespace takt::alignment
