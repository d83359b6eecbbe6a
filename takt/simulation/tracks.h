// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "takt/simulation/camera.h"

namespace takt {

/// How features are followed from frame to frame.
struct SimulatedTracking {
  int landmarks = 1500;         ///< in the whole room; about a tenth is in view
  double pixel_noise_px = 0.5;  ///< σ of u and of v
  double outlier_fraction = 0;  ///< of the observations: seen 5 to 50 px away, in any direction
  double mean_length = 60;      ///< frames until a feature is lost; it comes back under a new id
  double miss_fraction = 0.01;  ///< of the observations are not made; the id ends there
};

/// Landmarks as a feature tracker would report them. On a rolling shutter each is seen when its own row is read.
/// `exposures` and the stream's stamps belong together.
[[nodiscard]] TrackStream simulate_tracks(const Trajectory& truth, const SimulatedCamera& camera,
                                          const SimulatedTracking& tracking, std::span<const Vec3> landmarks,
                                          std::span<const Exposure> exposures, std::uint64_t seed);

/// One frame's view of the world, row by row.
class FrameView {
 public:
  /// `middle_s`: the exposure middle of the first row.
  FrameView(const Trajectory& truth, const SimulatedCamera& camera, const CameraModel& model, double middle_s);
  /// Where a world point is seen: solves for the row at which it is read. Nothing where it is not in the image.
  [[nodiscard]] std::optional<Vec2> pixel_of(const Vec3& point_world) const;

 private:
  const Trajectory& truth_;
  const CameraModel& model_;
  Mat4 T_body_cam_;
  double middle_s_, line_delay_s_;
  double margin_px_;                  ///< twice what the picture moves by until the farthest row is read
  Eigen::Isometry3d cam_from_world_;  ///< when the middle row is read
};

}  // namespace takt
