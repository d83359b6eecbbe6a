// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/motion/rotation.h"

namespace takt {

/// Gravity in the world frame, whose z axis points up (m/s²).
[[nodiscard]] Vec3 gravity_world();

/// The true motion of a rigid body as a function of time. Four functions say all; what sensors feel is derived.
/// Times in seconds from the motion's own zero, which a simulator places on a clock.
class Trajectory {
 public:
  virtual ~Trajectory() = default;

  /// Takes points from the body frame to the world frame (m).
  [[nodiscard]] virtual Eigen::Isometry3d world_from_body(double t_s) const = 0;
  /// Angular velocity in the body frame (rad/s): d/dt R = R·hat(ω).
  [[nodiscard]] virtual Vec3 omega_body(double t_s) const = 0;
  /// First and second derivative of the body's position in the world frame (m/s, m/s²).
  [[nodiscard]] virtual Vec3 velocity_world(double t_s) const = 0;
  [[nodiscard]] virtual Vec3 acceleration_world(double t_s) const = 0;

  /// What an ideal accelerometer at the body's origin reads: R⁻¹·(a − g) (m/s²). An ideal gyro reads `omega_body`.
  [[nodiscard]] Vec3 specific_force_body(double t_s) const;
};

}  // namespace takt
