// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "takt/estimators/online/sighting.h"

namespace takt::online {

/// How far one frame seems to stand from where its stamp has it, by points known from the frames before: what a step
/// of the offset shows at once, long before the estimate has followed it.
class FrameSlip {
 public:
  /// A point seen in the frame, against where the IMU says that the camera was.
  /// `pose_per_s`: derivative of the clone's θ and p. `point`: covariance of the landmark before this sighting.
  void add(const Observed& seen, const Eigen::Matrix<double, 6, 1>& pose_per_s, double pixel_sigma, const Mat3& point);
  /// In sigmas, with its sign; 0 where too few points tell. `time_sigma_s`: what stamp and offset may be off anyway.
  [[nodiscard]] double sigmas(double time_sigma_s) const;
  /// How much of a misfit's variance the points bring, which they bring to the next frames too.
  [[nodiscard]] double shared() const { return rows_.empty() ? 0 : shared_ / static_cast<double>(rows_.size()); }

 private:
  struct Row {
    Eigen::Matrix<double, 2, 7> by;  ///< seconds, θ, p; whitened
    Vec2 residual;
  };
  std::vector<Row> rows_;
  double shared_ = 0;
};

}  // namespace takt::online
