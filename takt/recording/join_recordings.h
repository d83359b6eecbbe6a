// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/streams/streams.h"

namespace takt {

/// Appends a recording that goes on where another ended: streams of the same name become one.
void join(Recording& all, Recording next);

}  // namespace takt
