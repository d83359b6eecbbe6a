// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/recording/format.h"

namespace takt {

/// A ROS 1 bag with other stamps: a streamed copy, one chunk in memory at a time. Chunks in which nothing changes, and
/// all other records, are copied byte for byte; places in the index are corrected. `out` may be empty: a rehearsal.
[[nodiscard]] Restamped restamp_ros1_bag(const std::string& in, const std::string& out, const Restamping& order,
                                         const OpenOptions& options);

}  // namespace takt
