// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/trajectory.h"

namespace takt {

Vec3 gravity_world() {
  return {0, 0, -9.81};
}

Vec3 Trajectory::specific_force_body(double t_s) const {
  return world_from_body(t_s).linear().transpose() * (acceleration_world(t_s) - gravity_world());
}

}  // namespace takt
