// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/simulation/target_film.h"
#include "takt/streams/corners.h"

/// A rig before a board without any picture: corners as a detector would give them.
namespace takt {

/// How a detector finds the corners.
struct SimulatedDetection {
  double noise_px = 0.07;       ///< σ of u and of v
  double outlier_fraction = 0;  ///< of the corners: seen 2 to 20 px away, in any direction
  double miss_fraction = 0.01;  ///< of the corners are not found
  double absent_until_s = 0;    ///< the board comes into view only then
};

struct SimulatedBoard {
  std::vector<CornerStream> cameras;
  std::vector<ImuStream> imus;
  Estimate truth;  ///< the film's
  TargetFilm film;
};
[[nodiscard]] SimulatedBoard simulate_board(const TargetFilmOptions& options, const SimulatedDetection& detection = {});

}  // namespace takt
