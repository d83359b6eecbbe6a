// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/streams/target.h"
#include "takt/workflows/print_dial.h"

namespace takt {

struct PrintedTarget {
  std::string pdf;
  std::string yaml;                    ///< its description for takt calibrate and Kalibr
  double width_mm = 0, height_mm = 0;  ///< of the ink
  double page_width_mm = 0, page_height_mm = 0;
};

/// A board on one page, true to scale, as seen from the front, with a ruler and its description below.
/// Without a paper size the page is the smallest of A4 to A0 that holds it, upright or on its side, else as large as
/// need be. Throws std::invalid_argument for a board that cannot be, or that a given paper does not hold.
[[nodiscard]] PrintedTarget print_target(const Target& target, const std::optional<PaperSize>& paper = {});

}  // namespace takt
