// SPDX-License-Identifier: Apache-2.0
#include "takt/apply/stamp_map.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

Estimate answer(std::int64_t offset_ns, double drift = 0) {
  Estimate e;
  e.verdict = Verdict::trusted;
  e.offset = Duration(offset_ns);
  e.epoch = from_ns(1'000'000'000'000);
  e.drift = drift;
  return e;
}

TEST(StampMap, MovesTheSensorToTheReferencesClock) {
  const auto map = stamp_map(answer(3'177'000, 10e-6), Moved::sensor);
  EXPECT_EQ(to_ns(map(from_ns(1'000'000'000'000))), 1'000'003'177'000);
  EXPECT_EQ(to_ns(map(from_ns(1'100'000'000'000))), 1'100'003'177'000 + 1'000'000);  // 100 s of 10 ppm
}

TEST(StampMap, TheReferenceMovesTheOtherWay) {
  const Estimate e = answer(-20'000'000, 50e-6);
  const auto there = stamp_map(e, Moved::sensor), back = stamp_map(e, Moved::reference);
  for (const std::int64_t ns : {0LL, 1'000'000'000'000LL, 1'403'715'273'262'142'976LL})
    EXPECT_NEAR(static_cast<double>(to_ns(back(there(from_ns(ns)))) - ns), 0, 1);
}

TEST(StampMap, PiecesCountWhereTheyHold) {
  Estimate e = answer(1000);
  e.pieces = {{from_ns(0), from_ns(0), Duration(1000), 0, 1e-6},
              {from_ns(5000), from_ns(5000), Duration(2000), 0, 1e-6}};
  const auto map = stamp_map(e, Moved::sensor);
  EXPECT_EQ(to_ns(map(from_ns(4999))), 5999);
  EXPECT_EQ(to_ns(map(from_ns(5000))), 7000);
}

TEST(StampMap, ARefusalHasNoMap) {
  EXPECT_THROW(static_cast<void>(stamp_map(Estimate::refusal("ml", "still"), Moved::sensor)), std::logic_error);
}

TEST(StampMap, MeaningsAreConvertedByExposureAndReadout) {
  FrameTiming timing;
  timing.instant = ExposureInstant::start;
  timing.rows = 1000;
  const double exposure_s = 0.004, line_delay_s = 20e-6;
  const auto shift = [&](FrameMeaning wanted) {
    return meaning_shift(timing, exposure_s, line_delay_s, wanted).count();
  };
  EXPECT_EQ(shift({}), 0);
  EXPECT_EQ(shift({ExposureInstant::middle, {}}), 2'000'000);
  EXPECT_EQ(shift({ExposureInstant::end, {}}), 4'000'000);
  EXPECT_EQ(shift({ExposureInstant::middle, RowReference::middle}), 12'000'000);
  timing.row = RowReference::middle;
  EXPECT_EQ(shift({{}, RowReference::first}), -10'000'000);
  EXPECT_EQ(shift({ExposureInstant::start, RowReference::middle}), 0);
}

}  // namespace
}  // namespace takt
