// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "takt/motion/rotation.h"

/// Corners that miss their places in the same way wherever they are seen in one part of the picture.
namespace takt::batch {

/// What is left after the noise of single corners is averaged out, cell by cell of the picture: a lens of the wrong
/// kind, a wrong camchain, a detector's bias. It is in no σ that counts corners as independent.
struct ResidualField {
  double systematic_px = 0;  ///< rms of a coordinate of the cells' means, beyond what their noise explains
  double chi2_per_dof = 1;   ///< of the cells' means
  int dof = 0;
  [[nodiscard]] bool is_clear() const;  ///< more than chance does once in millions
};

/// `at_px`, `off_px`: where corners were seen, and by how much they miss. `noise_px`: of one coordinate of a corner.
[[nodiscard]] ResidualField residual_field(std::span<const Vec2> at_px, std::span<const Vec2> off_px, int width,
                                           int height, double noise_px);

}  // namespace takt::batch
