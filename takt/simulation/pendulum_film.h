// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "takt/simulation/dial_renderer.h"
#include "takt/simulation/pendulum_rig.h"
#include "takt/streams/streams.h"

namespace takt {

/// What the camera on the bob recorded: pictures of the dial, rendered when they are read.
struct PendulumFilm {
  CameraStream camera;
  std::vector<double> reading_rad;  ///< truth: mean over the exposure of the first row, one a frame
};

/// The reading is the scene's `rest_deg` plus the pendulum's angle plus the rig's rest reading; stamps as those of
/// `simulate_pendulum` with the same seed. `threads` share the rows of a picture; 0: as many as there are cores.
[[nodiscard]] PendulumFilm film_pendulum(const PendulumRig& rig, const DialScene& scene, std::uint64_t seed,
                                         int threads = 0);

}  // namespace takt
