// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <vector>

#include "takt/streams/corners.h"
#include "takt/streams/streams.h"
#include "takt/streams/target.h"

namespace takt {

/// A board's corners in the pictures of each camera; `progress` gets the share of them all, 0 to 1.
[[nodiscard]] std::vector<CornerStream> see_board(const std::vector<CameraStream>& cameras, const Target& target,
                                                  int threads, const std::function<void(double done)>& progress);

}  // namespace takt
