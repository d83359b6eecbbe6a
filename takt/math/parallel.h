// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>

namespace takt {

/// body(i) for i in [0, count), on `threads` threads (0: as many as there are cores), in no particular order.
/// The first exception is thrown again here, once all have stopped.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

}  // namespace takt
