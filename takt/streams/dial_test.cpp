// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/dial.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>
#include <stdexcept>

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;

TEST(Dial, NoElevenCellsComeTwice) {
  std::set<unsigned> seen;
  for (long n = 0; n < 2047; ++n) {
    unsigned window = 0;
    for (long i = 0; i < 11; ++i) window = window << 1 | (dial_cell(n + i) ? 1u : 0u);
    EXPECT_TRUE(seen.insert(window).second) << n;
  }
  EXPECT_EQ(dial_cell(-3), dial_cell(2044));
}

TEST(Dial, InkShareIsTheMeanOfTheInk) {
  for (const DialKind kind : {DialKind::plain, DialKind::coded}) {
    Dial dial;
    dial.kind = kind;
    for (const double height : {0.029, 0.012, 0.0, -0.02, -0.028}) {
      const double from = 9.77 * deg, to = 10.63 * deg;
      double mean = 0;
      const int n = 20000;
      for (int i = 0; i < n; ++i) mean += ink(dial, from + (i + 0.5) / n * (to - from), height) ? 1.0 / n : 0;
      EXPECT_NEAR(ink_share(dial, from, to, height), mean, 1e-3) << height;
    }
    EXPECT_EQ(ink_share(dial, 0.1, 0.2, 0.031), 0);
    EXPECT_FALSE(ink(dial, -0.01, 0.02));
  }
}

TEST(Dial, RefusesWhatCannotBePrinted) {
  Dial dial;
  EXPECT_NO_THROW(check(dial));
  dial.radius_m = 0;
  EXPECT_THROW(check(dial), std::invalid_argument);
  dial = {.from_deg = 0, .to_deg = 360, .cell_deg = 0.1};
  EXPECT_THROW(check(dial), std::invalid_argument) << "3600 cells cannot be told apart";
}

}  // namespace
}  // namespace takt
