// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/sample_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace takt {
namespace {

constexpr double period_ns = 2'515'449.0;  // 397.55 Hz
constexpr double tolerance_ns = 5e6;

/// As gtest's EXPECT_NEAR wants it.
double ns(std::int64_t t) {
  return static_cast<double>(t);
}

/// `count` blocks of `rows` samples, stamped without error.
std::vector<BlockMark> exact_marks(int count, std::int64_t rows = 398) {
  std::vector<BlockMark> marks;
  for (int k = 0; k < count; ++k)
    marks.push_back({k * rows, std::llround(1e9 + period_ns * static_cast<double>(k * rows))});
  return marks;
}

TEST(SampleClock, ExactMarksGiveTheirLineToTheNanosecond) {
  const std::vector<BlockMark> marks = exact_marks(3600);
  const SampleClock clock(marks, 1e6, tolerance_ns);
  ASSERT_EQ(clock.pieces().size(), 1u);
  for (std::size_t k = 0; k < marks.size(); k += 371)
    EXPECT_NEAR(ns(clock.time_ns(k, marks[k].sample)), ns(marks[k].time_ns), 1);
  EXPECT_NEAR(clock.period_ns(), period_ns, 1e-4);
}

TEST(SampleClock, BatchesCutLateDoNotTiltTheRate) {
  // Marks early by up to 8 samples, as a queue that is emptied by sevens gives: sd 5.8 ms over one hour.
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> early(0, 8 * period_ns);
  std::vector<BlockMark> marks = exact_marks(3600);
  for (BlockMark& m : marks) m.time_ns -= std::llround(early(random));
  const SampleClock clock(marks, 1e6, 50e6);
  ASSERT_EQ(clock.pieces().size(), 1u);
  const double sd = 8 * period_ns / std::sqrt(12.0), n = 3600;
  // Standard error of a slope over n even steps; 4 sigma is passed wrongly by 6 in 100 000.
  EXPECT_NEAR(clock.period_ns(), period_ns, 4 * sd * std::sqrt(12.0 / (n * n * n)) / 398);
  EXPECT_NEAR(ns(clock.time_ns(1800, 1800 * 398)), 1e9 + period_ns * 1800 * 398 - 4 * period_ns, 4 * sd / std::sqrt(n));
}

TEST(SampleClock, AWildFirstMarkIsAnOutlier) {
  std::vector<BlockMark> marks = exact_marks(13);
  marks[0].time_ns -= 33'000'000;
  const SampleClock clock(marks, 1e6, tolerance_ns);
  ASSERT_EQ(clock.pieces().size(), 1u);
  EXPECT_EQ(clock.pieces()[0].outliers, 1u);
  EXPECT_NEAR(ns(clock.time_ns(6, marks[6].sample)), ns(marks[6].time_ns), 1000);
  EXPECT_NEAR(ns(clock.time_ns(0, 0)), 1e9, 1000);
}

TEST(SampleClock, APauseBeginsANewLine) {
  std::vector<BlockMark> marks = exact_marks(60);
  for (std::size_t k = 25; k < marks.size(); ++k) marks[k].time_ns += 40'000'000;
  const SampleClock clock(marks, 1e6, tolerance_ns);
  ASSERT_EQ(clock.pieces().size(), 2u);
  EXPECT_EQ(clock.pieces()[1].first_mark, 25u);
  for (const std::size_t k : {0u, 24u, 25u, 59u})
    EXPECT_NEAR(ns(clock.time_ns(k, marks[k].sample)), ns(marks[k].time_ns), 2) << k;
}

TEST(SampleClock, LostBlocksThatWereCountedAreNoStep) {
  std::vector<BlockMark> marks = exact_marks(60);
  marks.erase(marks.begin() + 20, marks.begin() + 30);
  EXPECT_EQ(SampleClock(marks, 1e6, tolerance_ns).pieces().size(), 1u);
}

TEST(SampleClock, ACounterThatStartsAgainBeginsANewLine) {
  std::vector<BlockMark> marks = exact_marks(10), again = exact_marks(10);
  for (BlockMark& m : again) m.time_ns += 20'000'000'000;
  marks.insert(marks.end(), again.begin(), again.end());
  const SampleClock clock(marks, 1e6, tolerance_ns);
  ASSERT_EQ(clock.pieces().size(), 2u);
  EXPECT_NEAR(ns(clock.time_ns(10, 5)), 21e9 + 5 * period_ns, 2);
}

TEST(SampleClock, OneMarkAloneGoesByTheNominalRate) {
  const SampleClock clock({{100, 5'000}}, 1000, tolerance_ns);
  EXPECT_EQ(clock.time_ns(0, 100), 5'000);
  EXPECT_EQ(clock.time_ns(0, 103), 8'000);
}

TEST(SampleClock, ABrokenContractIsSaid) {
  EXPECT_THROW(SampleClock({}, 1, 1), std::invalid_argument);
  EXPECT_THROW(SampleClock({{0, 0}}, 0, 1), std::invalid_argument);
}

}  // namespace
}  // namespace takt
