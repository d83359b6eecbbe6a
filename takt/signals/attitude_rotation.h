// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/streams/rotation_signal.h"
#include "takt/streams/streams.h"

namespace takt {

/// How a device turned between consecutive samples of its orientation (poses, a camera's CORI). The error of one
/// orientation is measured from the differences of the turning rate that no smooth motion makes: noise and quantisation
/// alike. Samples that repeat the orientation before them while it was turning (a log written faster than it is
/// measured) are left out and noted; so are stamps that do not advance. No increment spans a gap.
[[nodiscard]] RotationSignal attitude_rotation(const AttitudeStream& attitude);

}  // namespace takt
