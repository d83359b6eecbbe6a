// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/signals/target/saddle.h"

namespace takt {

/// Finds a known constellation again: which of `candidates` each of `expected` is, after the whole has shifted by tens
/// of pixels and turned and grown by a few per cent. By the shift that most pairs agree on, then by matching the
/// nearest under an affine map, closer and closer. Empty where half of those that should be in the picture stay alone.
[[nodiscard]] std::vector<std::optional<Vec2>> follow(const std::vector<Crossing>& expected,
                                                      const std::vector<Crossing>& candidates, int width, int height);

/// Whether two crossings have their light quadrants in about the same direction.
[[nodiscard]] bool alike(const Crossing& a, const Crossing& b);

}  // namespace takt
