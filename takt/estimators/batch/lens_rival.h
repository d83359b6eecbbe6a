// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/estimators/batch/board_pose.h"

/// Whether a lens of another kind explains the same corners better. One that is mixed up with another bends by some
/// thousandths of a pixel only, once its numbers are fitted; but these then put the camera elsewhere by many σ.
namespace takt::batch {

struct LensRival {
  std::string name;     ///< as --lens has it
  double noise_px = 0;  ///< corners' residuals with it
  /// χ² by which it fits better than a lens of the kind given, both fitted to the corners; errors that corners of one
  /// part of the picture still share count as one.
  double gain = 0;
  double turn_rad = 0, shift_m = 0;  ///< by which it would see the board elsewhere, in the mean
  /// Chance alone reaches this once in billions.
  static constexpr double clear_gain = 50;
};

/// The better one of pinhole-radtan and pinhole-equi that is not the lens' own kind; nothing where neither is clearly
/// better. `views` at their poses with `model`.
[[nodiscard]] std::optional<LensRival> find_lens_rival(const CameraModel& model, std::span<const BoardView> views,
                                                       const std::vector<Vec3>& board, double noise_px, int threads);

}  // namespace takt::batch
