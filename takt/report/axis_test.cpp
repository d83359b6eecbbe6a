// SPDX-License-Identifier: Apache-2.0
#include "takt/report/axis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace takt::report {
namespace {

std::string labels(const Axis& axis, int about = 5) {
  std::string out;
  for (const Tick& t : axis.ticks(about)) out += (out.empty() ? "" : " ") + t.label;
  return out;
}

TEST(Axis, TicksAreRoundNumbers) {
  EXPECT_EQ(labels(make_axis("", "", {0, 10})), "0 2 4 6 8 10");
  EXPECT_EQ(labels(make_axis("", "", {-0.31, 0.29})), "−0.2 0.0 0.2");
  EXPECT_EQ(labels(make_axis("", "", {0, 1})), "0.0 0.2 0.4 0.6 0.8 1.0");
}

TEST(Axis, TheUnitFitsTheRange) {
  const Axis ms = make_axis("offset", "s", {0.0118, 0.0129});
  EXPECT_EQ(ms.label(), "offset, ms");
  EXPECT_EQ(labels(ms), "12.0 12.5");
  EXPECT_EQ(make_axis("", "rad", {-1e-4, 1e-4}).label(), "µrad");
  EXPECT_EQ(make_axis("time", "s", {0, 3600}).label(), "time, s");
  EXPECT_EQ(make_axis("p", "px", {0, 2e-5}).label(), "p, 10⁻⁶ px");
}

TEST(Axis, SharedLeadingDigitsAreSaidOnce) {
  const Axis axis = make_axis("offset", "s", {947848.6380, 947848.6392});
  EXPECT_EQ(axis.label(), "offset − 947848.63 s, ms");
  EXPECT_EQ(labels(axis), "8.0 8.5 9.0");
  EXPECT_NEAR(axis.position(947848.6386), 0.5, 1e-5);
}

TEST(Axis, EmptyAndInfiniteRangesCanBeDrawn) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const Range r :
       {Range{inf, -inf}, Range{0, 0}, Range{5, 5}, Range{0, inf}, Range{NAN, NAN}, Range{1e300, 1e300}}) {
    const Axis axis = make_axis("", "s", r);
    EXPECT_GT(axis.range.width(), 0);
    EXPECT_TRUE(std::isfinite(axis.range.width()));
    const auto ticks = axis.ticks(5);
    EXPECT_GE(ticks.size(), 2u);
    EXPECT_LE(ticks.size(), 12u);
  }
}

}  // namespace
}  // namespace takt::report
