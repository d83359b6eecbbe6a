// SPDX-License-Identifier: Apache-2.0
#include "takt/time/time_scales.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

constexpr std::int64_t s = 1'000'000'000;

TEST(TimeScales, KnownInstants) {
  // 2017-01-01 00:00:00 UTC is GPS week 1930, second 18 of the week.
  const auto utc = from_ns<Utc>(1483228800 * s);
  EXPECT_EQ(to_ns(to_gps(utc)), (1930 * 604800 + 18) * s);
  EXPECT_EQ(to_ns(to_tai(utc)) - to_ns(utc), 37 * s);
  EXPECT_EQ(to_string(utc), "2017-01-01T00:00:00.000000000Z");
  EXPECT_EQ(to_ns(to_gps(from_ns<Utc>(gps_epoch_utc_s * s))), 0);
}

TEST(TimeScales, RoundTripsAtEveryLeapSecond) {
  for (const LeapSecond& leap : leap_seconds)
    for (const std::int64_t d : {-2 * s, -s - 1, std::int64_t{0}, std::int64_t{1}, s, 5 * s}) {
      const auto utc = from_ns<Utc>(leap.utc_s * s + d);
      EXPECT_EQ(to_utc(to_tai(utc)), utc) << leap.utc_s << " " << d;
      EXPECT_EQ(to_utc(to_gps(utc)), utc) << leap.utc_s << " " << d;
    }
}

TEST(TimeScales, TheLeapSecondItselfRepeatsTheSecondBefore) {
  const auto before = to_tai(from_ns<Utc>(1483228799 * s));  // 2016-12-31T23:59:59
  const auto leap = before + std::chrono::seconds(1);        // 23:59:60
  EXPECT_EQ(to_ns(to_utc(leap)), 1483228799 * s);
  EXPECT_EQ(to_ns(to_utc(leap + std::chrono::seconds(1))), 1483228800 * s);
}

}  // namespace
}  // namespace takt
