// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <functional>

#include "takt/streams/corners.h"
#include "takt/streams/streams.h"
#include "takt/streams/target.h"

namespace takt {

struct TargetCornersOptions {
  int threads = 0;  ///< 0: as many as there are cores; the answer is the same for any number
  std::function<void(std::size_t done, std::size_t total)> progress = {};
};

/// A board's corners in every frame of a camera, to hundredths of a pixel. Frames are taken in pieces of fixed length,
/// each piece starting with a search of the whole picture, so that pieces are independent and memory stays bounded.
/// Corners that are blurred, covered, at odds with their neighbours or next to the picture's edge are left out, and so
/// are frames in which fewer than eight remain.
/// Stamps, exposures, timing, model and mounting are the stream's own. Throws what the reader throws.
[[nodiscard]] CornerStream find_target_corners(const CameraStream& stream, const Target& target,
                                               const TargetCornersOptions& options = {});

}  // namespace takt
