// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <vector>

#include "takt/signals/dial/rectifier.h"
#include "takt/streams/streams.h"

namespace takt::dial {

/// A recording reduced to one profile a frame: all of it stays in memory, some 5 kB a frame, and 25 of a rolling
/// shutter's.
struct Film {
  std::vector<std::size_t> index;  ///< of the frames that could be decoded, ascending
  std::vector<double> time_s;      ///< their stamps, from the first one's
  double interval_s = 1;           ///< median of the stamps' steps
  std::vector<double> exposures_s;
  std::vector<Profile> profiles;
};

/// Threads decode stretches of the film side by side, each with a reader of its own.
[[nodiscard]] Film read_film(const CameraStream& camera, const Rectifier& rectify, int threads,
                             const std::function<void(std::size_t done, std::size_t total)>& progress);

/// body(i) for i in [0, count), in stretches on `threads` threads (0: as many as there are cores).
void in_parallel(std::size_t count, int threads, const std::function<void(std::size_t)>& body);

}  // namespace takt::dial
