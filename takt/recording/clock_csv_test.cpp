// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/clock_csv.h"

#include <fmt/core.h>

#include <gtest/gtest.h>

#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;

PulseStream pulses(const std::string& text, ClockCsvOptions options = {}) {
  return read_pulses_csv(text, "pps.csv", options);
}
std::string counted(const char* header, double per_second, int rows = 20) {
  std::string text = header;
  for (int i = 0; i < rows; ++i) text += fmt::format("{}\n", std::llround(1000 + i * per_second));
  return text;
}

TEST(PulsesCsv, StampsAreNsOrTicksOfAUsualCounter) {
  EXPECT_EQ(pulses(counted("", 1e9 * (1 + 37e-6))).counter.tick_hz, 1e9);
  EXPECT_EQ(pulses(counted("", 48e6 * (1 - 80e-6))).counter.tick_hz, 48e6);
  EXPECT_EQ(pulses(counted("ticks\n", 32768)).counter.tick_hz, 32768);
  EXPECT_EQ(pulses(counted("t_us\n", 1e6)).counter.tick_hz, 1e9) << "stamps with a unit become ns";
  EXPECT_EQ(pulses(counted("", 25.175e6), {.tick_hz = 25.175e6}).counter.tick_hz, 25.175e6);
  EXPECT_NE(complaint([] { (void)pulses(counted("", 25.175e6 * 1.0004)); }).find("--tick-hz"), std::string::npos);
}

TEST(PulsesCsv, ColumnsAreFoundByName) {
  const PulseStream p =
      pulses("seq,edge,t_ns,utc_s\n7,rising,1000,1700000000\n8,falling,100001000,\n9,1,1000001000,1700000001\n");
  ASSERT_EQ(p.size(), 3U);
  EXPECT_EQ(p.pulses[1].ticks, 100001000);
  EXPECT_EQ(p.pulses[1].edge, Edge::falling);
  EXPECT_EQ(p.pulses[2].edge, Edge::rising);
  EXPECT_EQ(p.pulses[0].sequence, 7U);
  EXPECT_EQ(p.pulses[0].label_utc_s, 1700000000);
  EXPECT_FALSE(p.pulses[1].label_utc_s.has_value());
}

TEST(PulsesCsv, SecondsKeepEveryNanosecond) {
  const PulseStream p = pulses("1700000000.123456789\n1700000001.123456790\n1700000002.123456791\n");
  EXPECT_EQ(p.pulses[1].ticks, 1700000001123456790);
}

TEST(PulsesCsv, ACounterOf64BitsRunsOver) {
  const PulseStream p = pulses("18446744073709551000\n999999384\n1999999384\n2999999384\n");
  EXPECT_EQ(p.pulses[1].ticks - p.pulses[0].ticks, 1'000'000'000);
}

TEST(PulsesCsv, ALogOfIntervalsIsAddedUp) {
  // 1e6 − µs counted; one pulse is missed.
  const PulseStream p = pulses("6700\n6704\n6700\n6700\n-986600\n6700\n6704\n6700\n6704\n6700\n");
  EXPECT_EQ(p.counter.tick_hz, 1e6);
  ASSERT_EQ(p.size(), 11U);
  EXPECT_EQ(p.pulses[1].ticks, 993300);
  EXPECT_EQ(p.pulses[5].ticks - p.pulses[4].ticks, 1986600);
}

TEST(PulsesCsv, NonsenseIsSaid) {
  EXPECT_NE(complaint([] { (void)pulses(""); }), "");
  EXPECT_NE(complaint([] { (void)pulses("ticks\n1\nx\n3\n"); }).find("pps.csv:3"), std::string::npos);
  EXPECT_NE(complaint([] { (void)pulses("t_ns,edge\n1,up\n2,sideways\n"); }).find("sideways"), std::string::npos);
}

TEST(PairsCsv, OneWayAndTwoWay) {
  const PairStream one = read_pairs_csv("device_ns,arrival_ns\n1,2\n3,4\n", "pairs.csv");
  EXPECT_FALSE(one.two_way);
  EXPECT_EQ(one.pairs[1].arrival_ns, 4);
  const PairStream two = read_pairs_csv("0.000000001,0.000000005,0.000000009\n1.5,2.5,3.5\n", "pairs.csv");
  EXPECT_TRUE(two.two_way);
  EXPECT_EQ(two.pairs[0].device_ns, 5);
  EXPECT_EQ(two.pairs[1].arrival_ns, 3'500'000'000);
  const PairStream turned = read_pairs_csv("response_us,request_us,device_ms\n9,1,5\n19,11,15\n", "pairs.csv");
  EXPECT_EQ(turned.pairs[0].request_ns, 1000);
  EXPECT_EQ(turned.pairs[0].device_ns, 5'000'000);
  EXPECT_NE(complaint([] { (void)read_pairs_csv("1,2,3,4\n5,6,7,8\n", "pairs.csv"); }), "");
}

}  // namespace
}  // namespace takt
