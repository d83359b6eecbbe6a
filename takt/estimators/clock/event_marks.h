// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>

#include "takt/streams/clock_events.h"

namespace takt {

/// Exposures, or triggers, that a receiver stamped itself on one of its inputs (TIM-TM2).
struct MarkedEvents {
  StrobeStream strobes;       ///< on GPS time: ticks are ns since 1980; start = end where only the rising edge was told
  double accuracy_s = 0;      ///< the worst that the receiver says of those
  bool have_ends = false;     ///< falling edges were told too
  std::size_t unvouched = 0;  ///< marks left out: the receiver did not vouch for its time
  std::size_t lost = 0;       ///< by the receiver's own count of rising edges
};
/// Messages tell one edge or both, each edge once; what is told again or goes back is left out.
[[nodiscard]] MarkedEvents marked_events(std::span<const EventMark> marks, int channel);

}  // namespace takt
