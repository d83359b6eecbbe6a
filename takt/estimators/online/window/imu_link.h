// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/estimators/online/imu_motion.h"

namespace takt::online {

/// What the IMU says between two instants, whatever the motion was at the first [Forster2017]: pre-integrated once, and
/// corrected to first order as the biases are learned. Residual and errors in the order of MotionError: rotation in the
/// second frame, position and velocity in the first frame, biases.
class ImuLink {
 public:
  ImuLink(const ImuHistory& imu, double t0, double t1, const Motion& biases_of, const ImuNoise& noise);

  [[nodiscard]] double duration_s() const { return dt_; }
  /// Whether the biases are so far from those it was made with that first order no longer does.
  [[nodiscard]] bool stale(const Motion& from) const;

  [[nodiscard]] Vec15 residual(const Motion& from, const Motion& to) const;
  /// residual(from ⊞ a, to ⊞ b) ≈ residual + to_from·a + to_to·b.
  struct Jacobians {
    Mat15 to_from, to_to;
  };
  [[nodiscard]] Jacobians jacobians(const Motion& from, const Motion& to) const;
  /// Inverse covariance of the residual.
  [[nodiscard]] const Mat15& information() const { return information_; }

 private:
  double dt_ = 0;
  Vec3 gyro_bias_, accel_bias_;  ///< it was made with
  Quat rotation_;
  Vec3 position_, velocity_;  ///< without gravity, in the first frame
  Mat15 by_bias_;             ///< its bias columns: how the increments follow the biases
  Mat15 information_;
};

}  // namespace takt::online
