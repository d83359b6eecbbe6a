// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/units.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

std::vector<double> ramp(double start, double step) {
  std::vector<double> out;
  for (int i = 0; i < 50; ++i) out.push_back(start + i * step);
  return out;
}
TimeUnit found(const std::vector<double>& sample, const char* header = "") {
  return find_time_unit(sample, header, TimeUnit::automatic).unit;
}

TEST(Units, EveryUsualRateInEveryUnit) {
  const struct {
    TimeUnit unit;
    double a_second;
  } units[] = {{TimeUnit::s, 1}, {TimeUnit::ms, 1e3}, {TimeUnit::us, 1e6}, {TimeUnit::ns, 1e9}};
  for (const double rate_hz : {10.0, 25.0, 30.0, 100.0, 200.0, 400.0, 1000.0, 2000.0, 4000.0})
    for (const auto& u : units) {
      EXPECT_EQ(found(ramp(0, u.a_second / rate_hz)), u.unit) << rate_hz << " Hz in " << to_string(u.unit);
      EXPECT_EQ(found(ramp(1.7e9 * u.a_second, u.a_second / rate_hz)), u.unit) << rate_hz << " Hz, Unix time";
    }
}

TEST(Units, UptimeThatIsAsLargeAsUnixTimeIsToldByItsSpacing) {
  EXPECT_EQ(found(ramp(1.2e15, 2e6)), TimeUnit::ns);  // a phone that has been on for two weeks, 500 Hz
  EXPECT_EQ(found(ramp(1.2e9, 5e6)), TimeUnit::ns);   // or for a second
  EXPECT_EQ(found(ramp(2e12, 5000)), TimeUnit::us);
  EXPECT_EQ(found(ramp(1.7e9, 1)), TimeUnit::s);  // Unix time, once a second
}

TEST(Units, TheHeaderIsBelieved) {
  for (const char* name : {"t_ns", "timestamp [ns]", "time (ns)", "Time_NS"})
    EXPECT_EQ(found(ramp(0, 1), name), TimeUnit::ns) << name;
  for (const char* name : {"t_us", "time [us]", "time [\xc2\xb5s]"})
    EXPECT_EQ(found(ramp(0, 1), name), TimeUnit::us) << name;
  EXPECT_EQ(found(ramp(0, 1), "seconds_elapsed"), TimeUnit::s);
  EXPECT_EQ(found(ramp(0, 10), "timestamps"), TimeUnit::ms);  // its s is no unit
}

TEST(Units, WhatCannotBeToldIsCalledAGuess) {
  EXPECT_NE(find_time_unit({5, 5, 5}, "", TimeUnit::automatic).note.find("a guess"), std::string::npos);
  EXPECT_NE(find_time_unit(ramp(0, 1e-7), "", TimeUnit::automatic).note.find("a guess"), std::string::npos);
}

TEST(Units, DoubtfulRatesAreQuestioned) {
  std::vector<Vec3> rates(100, Vec3(0, 0, 1));
  for (std::size_t i = 0; i < 3; ++i) rates[i] = Vec3(0, 0, 20);
  EXPECT_NE(to_rad_per_s(rates, "wx", RateUnit::automatic).find("are they deg/s?"), std::string::npos);
  EXPECT_EQ(rates[0].z(), 20);
  for (std::size_t i = 0; i < 3; ++i) rates[i] = Vec3(0, 0, 90);
  EXPECT_NE(to_rad_per_s(rates, "wx [rad/s]", RateUnit::automatic).find("are they deg/s?"), std::string::npos);
  EXPECT_EQ(rates[0].z(), 90);
}

TEST(Units, AccelerationsByHeaderAndByGravity) {
  const auto one = [](double value, const char* header) {
    std::vector<Vec3> accel{Vec3(0, 0, value)};
    (void)to_m_per_s2(accel, header);
    return accel[0].z();
  };
  EXPECT_DOUBLE_EQ(one(1, ""), 9.80665);
  EXPECT_DOUBLE_EQ(one(1000, ""), 9.80665);
  EXPECT_DOUBLE_EQ(one(9.7, ""), 9.7);
  EXPECT_DOUBLE_EQ(one(2, "ax [g]"), 2 * 9.80665);
  EXPECT_DOUBLE_EQ(one(1, "a_RS_S_x [m s^-2]"), 1);
  EXPECT_DOUBLE_EQ(one(100, "ax"), 100);
}

TEST(Units, MilliUnitsAreTakenFromTheHeaderOrFromWhatNoGyroMeasures) {
  std::vector<Vec3> rates(50, Vec3(30000, 0, 0));
  EXPECT_NE(to_rad_per_s(rates, "gx_mdps gy_mdps gz_mdps", RateUnit::automatic).find("mdeg/s"), std::string::npos);
  EXPECT_NEAR(rates[0].x(), 0.5236, 1e-4);
  rates.assign(50, Vec3(30000, 0, 0));
  EXPECT_NE(to_rad_per_s(rates, "gx gy gz", RateUnit::automatic).find("mdeg/s"), std::string::npos);
  EXPECT_NEAR(rates[0].x(), 0.5236, 1e-4);
  rates.assign(50, Vec3(250, 0, 0));
  EXPECT_NE(to_rad_per_s(rates, "gx [mrad/s]", RateUnit::automatic).find("mrad/s"), std::string::npos);
  EXPECT_NEAR(rates[0].x(), 0.25, 1e-9);
}

}  // namespace
}  // namespace takt
