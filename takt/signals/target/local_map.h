// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/signals/target/board_layout.h"
#include "takt/signals/target/plane_map.h"

namespace takt {

/// The homography of the up to `most` pairs nearest to a place, none further than `furthest_m`; at least 5.
[[nodiscard]] std::optional<PlaneMap> local_map(const std::vector<PlacedPixel>& pairs, const Vec2& place,
                                                std::size_t most, double furthest_m);

/// The homography of a corner's nearest neighbours that are seen, itself among them or not; nothing where fewer than
/// five are near.
[[nodiscard]] std::optional<PlaneMap> map_around(const BoardLayout& layout,
                                                 const std::vector<std::optional<Vec2>>& pixels, int corner,
                                                 bool without_itself);

}  // namespace takt
