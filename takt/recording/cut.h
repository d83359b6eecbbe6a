// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "takt/streams/streams.h"

namespace takt {

/// Keeps what was stamped from `from_s` to `to_s` (both included), in seconds since the first stamp of each clock in
/// the recording. Pictures outside are not decoded where the format can skip. Throws takt::Error when nothing is left.
void cut(Recording& recording, std::optional<double> from_s, std::optional<double> to_s);

}  // namespace takt
