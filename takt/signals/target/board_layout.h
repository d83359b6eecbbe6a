// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/streams/target.h"

namespace takt {

/// What the detector needs to know about one corner of a board.
struct LayoutCorner {
  Vec2 place = Vec2::Zero();  ///< on the board (m)
  double sign = 1;            ///< +1: black where dx·dy > 0 around it, −1: where dx·dy < 0
  double reach_m = 0;         ///< half-width of the square around it in which nothing else is printed
};

/// A board for the detector: its corners, its markers, and which corners are near which.
struct BoardLayout {
  Target target;
  std::vector<LayoutCorner> corners;
  std::vector<BoardMarker> markers;
  std::vector<std::vector<int>> near;  ///< of each corner: the others, nearest first, up to 48 of them
  double pitch_m = 0;                  ///< distance of a corner to its nearest neighbour, the largest of all
  bool discs = false;                  ///< centres of discs instead of saddles
};

[[nodiscard]] BoardLayout board_layout(const Target& target);

}  // namespace takt
