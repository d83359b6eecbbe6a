// SPDX-License-Identifier: Apache-2.0
#include "takt/motion/trajectory.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

/// A turntable: the body at `radius` from a vertical axis, x axis outward, turning at `rate`.
class Turntable : public Trajectory {
 public:
  Turntable(double radius, double rate) : radius_(radius), rate_(rate) {}
  Eigen::Isometry3d world_from_body(double t) const override {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = exp_so3(Vec3(0, 0, rate_ * t)).toRotationMatrix();
    pose.translation() = pose.linear() * Vec3(radius_, 0, 0);
    return pose;
  }
  Vec3 omega_body(double) const override { return {0, 0, rate_}; }
  Vec3 velocity_world(double t) const override { return world_from_body(t).linear() * Vec3(0, radius_ * rate_, 0); }
  Vec3 acceleration_world(double t) const override {
    return world_from_body(t).linear() * Vec3(-radius_ * rate_ * rate_, 0, 0);
  }

 private:
  double radius_, rate_;
};

TEST(Trajectory, AnAccelerometerAtRestReadsUpward) {
  EXPECT_TRUE(Turntable(1, 0).specific_force_body(3).isApprox(Vec3(0, 0, 9.81)));
}

TEST(Trajectory, AnAccelerometerOnATurntableFeelsTheCentripetalForce) {
  EXPECT_TRUE(Turntable(0.5, 2).specific_force_body(1.7).isApprox(Vec3(-2, 0, 9.81), 1e-12));
}

}  // namespace
}  // namespace takt
