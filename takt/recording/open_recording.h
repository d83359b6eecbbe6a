// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/recording/format.h"

namespace takt {

/// Every format that takt reads, in the order in which they are tried.
[[nodiscard]] const std::vector<Format>& formats();

/// Opens a folder or file of any known format. Small streams are read at once; pictures are decoded when asked for.
/// Throws takt::Error for a path that does not exist, has no known format, or is broken.
[[nodiscard]] Recording open_recording(const std::string& path, const OpenOptions& options = {});

/// Writes the recording `in` with other stamps on one of its streams to `out`, which must not be there yet; only says
/// what would change where `out` is empty. Throws takt::Error, also for formats that cannot be written.
[[nodiscard]] Restamped restamp_recording(const std::string& in, const std::string& out, const Restamping& order,
                                          const OpenOptions& options = {});

}  // namespace takt
