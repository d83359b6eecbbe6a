// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/audit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace takt {
namespace {

std::vector<Stamp> stamps_of(const std::vector<std::int64_t>& ns) {
  std::vector<Stamp> out;
  for (const std::int64_t t : ns) out.push_back(from_ns(t));
  return out;
}
bool says(const std::vector<std::string>& words, const std::string& what) {
  for (const std::string& w : words)
    if (w.find(what) != std::string::npos) return true;
  return false;
}

TEST(Audit, EmptyAndSingle) {
  const StampAudit none = audit(std::vector<Stamp>{});
  EXPECT_EQ(none.count, 0u);
  EXPECT_FALSE(none.rate_hz);
  const StampAudit one = audit(stamps_of({5}));
  EXPECT_EQ(one.count, 1u);
  EXPECT_FALSE(one.rate_hz || one.jitter_s || one.resolution);
  EXPECT_FALSE(audit(stamps_of({5, 5, 5})).rate_hz);
}

TEST(Audit, GapsDuplicatesAndBackwardStepsAreCounted) {
  const StampAudit a = audit(stamps_of({0, 100, 200, 200, 300, 600, 500, 700, 800, 900, 1000}));
  EXPECT_EQ(a.duplicates, 1u);
  EXPECT_EQ(a.backward_steps, 1u);
  ASSERT_EQ(a.gaps.size(), 1u);  // 300 to 500, once in order
  EXPECT_EQ(to_ns(a.gaps[0].after), 300);
  EXPECT_DOUBLE_EQ(a.gaps[0].length_s, 200e-9);
  EXPECT_DOUBLE_EQ(*a.rate_hz, 1e7);
  EXPECT_EQ(a.resolution, Duration(100));
  EXPECT_TRUE(says(a.words, "1 of the stamps are before"));
}

TEST(Audit, JitterIsTheSpreadOfTheStamps) {
  // 20 000 stamps: the MAD's own spread is 1.17/√n of σ·1.1, so 3 % is more than 3 of its standard deviations.
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 50e3);
  std::vector<Stamp> stamps;
  for (int i = 0; i < 20'000; ++i)
    if (i % 997 != 0) stamps.push_back(from_ns(i * 5'000'123LL + std::llround(noise(random))));
  const StampAudit a = audit(stamps);
  EXPECT_NEAR(*a.jitter_s, 50e-6, 0.03 * 50e-6);
  EXPECT_EQ(a.gaps.size(), 20u);
}

TEST(Audit, ADriftingClockHasNoJitter) {
  std::vector<Stamp> stamps;
  for (int i = 0; i < 10'000; ++i) stamps.push_back(from_ns(i * 2'500'000LL + std::int64_t{i} * i / 1000));
  EXPECT_LT(*audit(stamps).jitter_s, 1e-6);
}

TEST(Audit, DoublesAreRecognised) {
  std::vector<Stamp> stamps;
  for (int i = 0; i < 100; ++i) {
    const double s = 1403715273.262142976 + i * 0.005;
    stamps.push_back(from_ns(static_cast<std::int64_t>(s * 1e9)));
  }
  EXPECT_TRUE(says(audit(stamps).words, "passed through a double"));
}

TEST(Audit, TheEndsOfTimeDoNotOverflow) {
  const StampAudit a =
      audit(stamps_of({std::numeric_limits<std::int64_t>::min(), 0, std::numeric_limits<std::int64_t>::max()}));
  EXPECT_GT(a.span_s, 1.8e10);
}

ImuStream still_imu(std::size_t n, double gyro_scale, double gravity) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0, 1);
  ImuStream imu;
  imu.name = "imu0";
  for (std::size_t i = 0; i < n; ++i) {
    imu.stamps.push_back(from_ns(static_cast<std::int64_t>(i) * 5'000'000));
    imu.gyro_rad_s.push_back(gyro_scale * Vec3(noise(random), noise(random), noise(random)));
    imu.accel_m_s2.push_back(gravity * Vec3(0.01 * noise(random), 0.01 * noise(random), 1));
  }
  return imu;
}

TEST(Audit, UnitsAreQuestioned) {
  EXPECT_TRUE(says(audit(still_imu(1000, 0.5, 9.81)).words, "plausible as rad/s"));
  EXPECT_TRUE(says(audit(still_imu(1000, 0.5, 9.81)).words, "look like m/s2"));
  EXPECT_TRUE(says(audit(still_imu(1000, 30, 1)).words, "rates look like deg/s"));
  EXPECT_TRUE(says(audit(still_imu(1000, 0.5, 1)).words, "look like g"));
  EXPECT_TRUE(says(audit(still_imu(1000, 0.5, 1000)).words, "look like mg"));
  EXPECT_TRUE(says(audit(still_imu(1000, 0.5, 100)).words, "no known unit"));
}

TEST(Audit, ClippedStuckAndBrokenValuesAreSaid) {
  ImuStream imu = still_imu(1000, 2.5, 9.81);
  EXPECT_FALSE(says(audit(imu).words, "clipped"));
  for (Vec3& w : imu.gyro_rad_s) w = w.cwiseMax(-4.3633).cwiseMin(4.3633);
  for (std::size_t i = 100; i < 110; ++i) imu.gyro_rad_s[i].x() = 4.3633;
  EXPECT_TRUE(says(audit(imu).words, "gyro x is clipped at 4.363 rad/s"));
  EXPECT_FALSE(says(audit(imu).words, "stuck"));
  for (std::size_t i = 500; i < 530; ++i) imu.gyro_rad_s[i] = Vec3(0.1, 0.2, 0.3);
  EXPECT_TRUE(says(audit(imu).words, "gyro is stuck for 30 samples"));
  imu.accel_m_s2[7].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(says(audit(imu).words, "1 rows have values that are not finite"));
}

TEST(Audit, TidySortsAndLeavesOut) {
  ImuStream imu = still_imu(6, 1, 9.81);
  imu.stamps = stamps_of({0, 20, 10, 10, 30, 40});
  imu.gyro_rad_s[4].z() = std::numeric_limits<double>::infinity();
  const Vec3 first_of_two = imu.gyro_rad_s[2];
  const Tidied tidied = tidy(imu);
  EXPECT_EQ(tidied.imu.stamps, stamps_of({0, 10, 20, 40}));
  EXPECT_EQ(tidied.imu.gyro_rad_s[1], first_of_two);
  EXPECT_EQ(tidied.imu.accel_m_s2.size(), 4u);
  EXPECT_EQ(tidied.words.size(), 3u);
  EXPECT_TRUE(tidy(tidied.imu).words.empty());
}

}  // namespace
}  // namespace takt
