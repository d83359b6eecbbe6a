// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/paper_batch.h"

#include <gtest/gtest.h>

namespace takt::paper {
namespace {

/// The slowest output and the longest filter, stamps at the start of a long exposure: all that makes the delay is
/// there.
TEST(PaperBatch, FindsTheRigsDelayOnFreeMotion) {
  PendulumRig rig = pendulum_rig("paper");
  rig.imus[0].filter_delay_s = 5.9e-3;
  rig.imus[0].output_rate_hz = 200;
  rig.camera.exposure_s = 2e-3;
  rig.camera.stamp = ExposureInstant::start;
  const BatchDelay d = batch_delay(rig, 3);
  ASSERT_NE(d.verdict, Verdict::refused);
  EXPECT_NEAR(d.truth, 1e3 * output_delay_s(rig.imus[0], rig.pendulum.natural_rad_s) + 1, 1e-5);
  EXPECT_LT(std::abs(d.delay - d.truth), 4 * d.sigma);
  EXPECT_LT(d.sigma, 0.02);
}

}  // namespace
}  // namespace takt::paper
