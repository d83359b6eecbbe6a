// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/trigger_sync.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/simulation/random.h"

namespace takt {
namespace {

/// Triggered at 20 Hz: own clock off by ppm and offset, arrivals late by least + exponential; `lost` of them.
std::vector<TriggeredSample> stream(double ppm, double offset_s, double least_s, double lost, std::uint64_t seed,
                                    std::vector<int>& numbers) {
  Random random(seed, "triggers");
  std::vector<TriggeredSample> out;
  for (int i = 0; i < 600; ++i) {
    const double t = 0.05 * i;
    const double arrival = t + least_s - 0.004 * std::log1p(-random.uniform());
    if (random.chance(lost)) continue;
    numbers.push_back(i);
    out.push_back({std::llround(1e9 * (offset_s + t * (1 + 1e-6 * ppm) + 5e-6 * random.normal())),
                   std::llround(1e9 * (1e6 + arrival))});
  }
  return out;
}

TEST(TriggerSync, LostFramesDoNotShiftTheRest) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::vector<int> na, nb;
    const auto a = stream(30, 123, 0.002, 0.05, seed, na), b = stream(-80, -7, 0.009, 0.1, seed + 100, nb);
    const TriggerSyncResult found = match_triggers(a, b);
    ASSERT_FALSE(found.ambiguous) << found.why;
    EXPECT_GT(found.matches.size(), 450U);
    for (const TriggerMatch& m : found.matches) {
      EXPECT_EQ(na[m.a], nb[m.b]);
      EXPECT_EQ(m.received_ns, std::min(a[m.a].arrival_ns, b[m.b].arrival_ns));
    }
  }
}

TEST(TriggerSync, HalfAPeriodLateIsAmbiguous) {
  std::vector<int> na, nb;
  const auto a = stream(0, 0, 0.002, 0, 1, na), b = stream(0, 0, 0.027, 0, 2, nb);
  EXPECT_TRUE(match_triggers(a, b).ambiguous);
}

struct Exposures {
  std::vector<FrameNote> frames;
  StrobeStream strobes;
  std::vector<int> frame_number, strobe_number;
};
/// 25 Hz; the exposure follows the light, so widths differ from frame to frame.
Exposures exposures(bool automatic, double lost_frames, double lost_strobes, std::uint64_t seed) {
  Random random(seed, "strobes");
  Exposures out;
  out.strobes.counter.tick_hz = 48e6;
  for (int i = 0; i < 500; ++i) {
    const double t = 0.04 * i,
                 exposure = automatic ? 0.004 + 0.002 * std::sin(0.31 * i) + 0.0005 * random.normal() : 0.005;
    const auto ticks = [&](double s) { return static_cast<std::int64_t>(std::floor(48e6 * (7 + s))); };
    if (!random.chance(lost_strobes)) {
      out.strobes.strobes.push_back({ticks(t), ticks(t + exposure), {}});
      out.strobe_number.push_back(i);
    }
    if (!random.chance(lost_frames)) {
      out.frames.push_back({std::llround(1e9 * (1000 + t * (1 + 50e-6)) + 2e4 * random.normal()), exposure});
      out.frame_number.push_back(i);
    }
  }
  return out;
}

TEST(PairFrames, DropsOnBothSidesAreSurvived) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Exposures e = exposures(true, 0.03, 0.02, seed);
    const FramePairing found = pair_frames(e.frames, e.strobes);
    EXPECT_FALSE(found.ambiguous) << found.why;
    std::size_t paired = 0;
    for (std::size_t i = 0; i < found.strobe_of.size(); ++i) {
      if (!found.strobe_of[i]) continue;
      ++paired;
      EXPECT_EQ(e.frame_number[i], e.strobe_number[*found.strobe_of[i]]) << seed;
    }
    EXPECT_GT(paired, 430U) << seed;
  }
}

TEST(PairFrames, EqualIntervalsAndExposuresAreAmbiguous) {
  const Exposures e = exposures(false, 0, 0, 1);
  const FramePairing found = pair_frames(e.frames, e.strobes);
  EXPECT_TRUE(found.ambiguous);
  for (const auto& strobe : found.strobe_of) EXPECT_FALSE(strobe.has_value());
}

TEST(CompensatedTriggers, MiddlesCoincide) {
  const std::vector<double> exposure{0.002, 0.010}, delay{0.0001, 0.0004};
  const std::vector<double> t = compensated_triggers(5, exposure, delay);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(t[i] + delay[i] + 0.5 * exposure[i], 5, 1e-12);
}

}  // namespace
}  // namespace takt
