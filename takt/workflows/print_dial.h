// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/streams/dial.h"

namespace takt {

struct PaperSize {
  double width_mm = 297, height_mm = 210;  ///< A4, landscape
};

struct PrintedDial {
  std::string pdf;
  std::size_t pages = 0;
  double length_mm = 0;  ///< of the strip along the arc
};

/// The dial as a strip true to scale, cut into pages that are joined edge to edge at marked lines, with the degrees
/// below it and a ruler on each page. The strip's face has the dial's radius: bent the other way round, or onto another
/// radius, its angles are wrong by that.
/// Throws std::invalid_argument for a dial that cannot be, or that is higher than the page.
[[nodiscard]] PrintedDial print_dial(const Dial& dial, const PaperSize& paper = {});

}  // namespace takt
