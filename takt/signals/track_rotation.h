// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

#include "takt/signals/pair_rotation.h"
#include "takt/streams/rotation_signal.h"
#include "takt/streams/streams.h"

namespace takt {

struct TrackRotationOptions {
  PairRotationOptions pair;  ///< `sigma_is_known` is set by the stream's pixel_sigma
  double longest_step_s = 0.5;
};

/// How a camera turned between consecutive frames of given feature tracks. The scatter of the tracks is the stream's
/// pixel_sigma where it says one, else it is measured. Stamps are moved to exposure middles as for pictures.
[[nodiscard]] RotationSignal track_rotation(const TrackStream& tracks, const TrackRotationOptions& options = {});

}  // namespace takt
