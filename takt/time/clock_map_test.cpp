// SPDX-License-Identifier: Apache-2.0
#include "takt/time/clock_map.h"

#include <gtest/gtest.h>

#include <random>

namespace takt {
namespace {

ClockMap<> two_pieces() {
  ClockPiece<SensorClock> a, b;
  a.epoch = from_ns<SensorClock>(1'500'000'000'000'000'000);
  a.offset = std::chrono::milliseconds(12);
  a.drift = 37e-6;
  a.offset_var_s2 = 1e-10;
  a.drift_var = 1e-14;
  b = a;
  b.start = a.epoch + std::chrono::seconds(100);
  b.epoch = b.start;
  b.offset = a.offset + std::chrono::nanoseconds(3'700'000) + std::chrono::milliseconds(5);  // a step of 5 ms
  b.drift = -80e-6;
  return ClockMap<>({a, b});
}

TEST(ClockMap, IdentityByDefault) {
  const ClockMap<> map;
  EXPECT_EQ(to_ns(map(from_ns<SensorClock>(42))), 42);
  EXPECT_EQ(map.sigma_s(from_ns<SensorClock>(42)), 0);
}

TEST(ClockMap, AppliesOffsetAndDriftFromTheEpoch) {
  const ClockMap<> map = two_pieces();
  const auto epoch = map.pieces()[0].epoch;
  EXPECT_EQ(map.offset_at(epoch), std::chrono::milliseconds(12));
  EXPECT_EQ(map.offset_at(epoch + std::chrono::seconds(10)), Duration(12'000'000 + 370'000));
  EXPECT_EQ(map.offset_at(epoch + std::chrono::seconds(100)), Duration(12'000'000 + 3'700'000 + 5'000'000));
  EXPECT_NEAR(map.sigma_s(epoch + std::chrono::seconds(50)), std::sqrt(1e-10 + 2500 * 1e-14), 1e-12);
}

TEST(ClockMap, InverseComesBackWithinANanosecond) {
  const ClockMap<> map = two_pieces();
  const auto back = inverse(map);
  std::mt19937_64 random(1);
  for (int i = 0; i < 10000; ++i) {
    const auto t =
        map.pieces()[0].epoch + Duration(static_cast<std::int64_t>(random() % 400'000'000'000) - 100'000'000'000);
    EXPECT_LE(std::abs((back(map(t)) - t).count()), 1);
  }
}

TEST(ClockMap, CompositionIsOneMapAfterTheOther) {
  const ClockMap<> first = two_pieces();
  ClockPiece<ReferenceClock> p;
  p.epoch = from_ns<ReferenceClock>(1'500'000'030'000'000'000);
  p.offset = std::chrono::hours(3);
  p.drift = 5e-6;
  p.offset_var_s2 = 4e-10;
  p.drift_var = 1e-15;
  ClockPiece<ReferenceClock> q = p;
  q.start = from_ns<ReferenceClock>(1'500'000'060'000'000'000);
  q.drift = -5e-6;
  const ClockMap<ReferenceClock, DeviceClock> second({p, q});
  const auto both = compose(first, second);
  for (int s = -20; s < 200; ++s) {
    const auto t = first.pieces()[0].epoch + std::chrono::milliseconds(s * 1000 + 7);
    EXPECT_LE(std::abs((both(t) - second(first(t))).count()), 2) << s;
    EXPECT_NEAR(both.sigma_s(t), std::hypot(first.sigma_s(t), second.sigma_s(first(t))), 1e-8) << s;
  }
}

TEST(ClockMap, RefusesWhatIsNoMap) {
  EXPECT_THROW(ClockMap<>(std::vector<ClockPiece<SensorClock>>{}), std::invalid_argument);
  ClockPiece<SensorClock> backwards;
  backwards.drift = -1;
  EXPECT_THROW(ClockMap<>{backwards}, std::invalid_argument);
}

}  // namespace
}  // namespace takt
