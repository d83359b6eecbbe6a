// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <string>

#include "takt/signals/dial/follow.h"

namespace takt::dial {

/// Frames that are there but say nothing.
struct Faults {
  std::size_t repeated = 0, glaring = 0, faint = 0, strange = 0;
  [[nodiscard]] std::size_t all() const { return repeated + glaring + faint + strange; }
  [[nodiscard]] std::string words(std::size_t frames) const;
};

/// Takes away readings that stand out from the rest, and says why.
[[nodiscard]] Faults leave_out_bad_frames(const Film& film, Readings& readings);

}  // namespace takt::dial
