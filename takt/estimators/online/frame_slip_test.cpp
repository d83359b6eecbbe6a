// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/frame_slip.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/simulation/random.h"

namespace takt::online {
namespace {

constexpr double focal_px = 400;

/// Points all around seen from where the IMU says, `late_s` after the stamp has it, while the camera turns.
FrameSlip frame(double late_s, std::uint64_t seed, std::size_t strangers = 0) {
  CameraModel model;
  model.width = 640, model.height = 480;
  model.fx = model.fy = focal_px, model.cx = 319.5, model.cy = 239.5;
  const Vec3 rate(0.3, -0.9, 0.4), velocity(0.5, 0.1, -0.2);
  Eigen::Matrix<double, 6, 1> per_s;
  per_s << rate, velocity;
  const Clone at;
  Clone really;
  really.R = exp_so3(late_s * rate), really.p = late_s * velocity;
  Random random(seed, "slip");
  FrameSlip slip;
  for (std::size_t i = 0; i < 40; ++i) {
    const Vec3 point(random.uniform(-2, 2), random.uniform(-1.5, 1.5), 4);
    const Vec3 q = really.R.conjugate() * (point - really.p);
    Vec2 pixel(focal_px * q.x() / q.z() + model.cx, focal_px * q.y() / q.z() + model.cy);
    pixel += Vec2(random.normal(), random.normal());
    if (i < strangers) pixel += Vec2(60, -30);
    const auto z = see(model, pixel);
    const Landmark l{Vec3::Zero(), point.normalized(), 1 / point.norm()};
    const auto o = observe(*z, at, Extrinsics{}, 0, l, false);
    if (o) slip.add(*o, per_s, 1, 1e-8 * Mat3::Identity());
  }
  return slip;
}

TEST(FrameSlip, SeesAStepAtOnceAndNothingElse) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_LT(std::abs(frame(0, seed).sigmas(0)), 4) << seed;
    EXPECT_GT(frame(0.005, seed).sigmas(0), 5) << seed;
    EXPECT_LT(frame(-0.005, seed).sigmas(0), -5) << seed;
    EXPECT_LT(std::abs(frame(0, seed, 3).sigmas(0)), 4) << seed;  // strangers
    EXPECT_LT(frame(0.005, seed).sigmas(0.005), 4) << seed;       // no more than the stamp's own jitter
  }
}

TEST(FrameSlip, SaysNothingOfAFewPoints) {
  EXPECT_EQ(FrameSlip().sigmas(0), 0);
}

}  // namespace
}  // namespace takt::online
