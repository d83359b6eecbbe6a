// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/csv_log.h"

#include <fmt/core.h>

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <numbers>

#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::real_data;

Recording read(const std::string& text, OpenOptions options = {}) {
  return read_csv_log(text, "log.csv", options);
}
std::string all_notes(const Recording& r) {
  std::string all;
  for (const std::string& note : r.notes) all += note + "\n";
  return all;
}
bool says(const Recording& r, const std::string& what) {
  return all_notes(r).find(what) != std::string::npos;
}

/// 100 rows of a 100 Hz gyro that starts at `start` in units of 10^-digits s.
std::string gyro_log(const char* separator, std::int64_t start, std::int64_t step, const char* header = "") {
  std::string text = header;
  for (int i = 0; i < 100; ++i) text += fmt::format("{1}{0}{2}{0}0.2{0}-0.3\n", separator, start + i * step, 0.001 * i);
  return text;
}

TEST(CsvLog, SeparatorsAreFound) {
  for (const char* separator : {",", ";", "\t", " ", ", ", "   "}) {
    const Recording r = read(gyro_log(separator, 0, 10'000'000));
    ASSERT_EQ(r.imus.size(), 1u) << '"' << separator << '"';
    EXPECT_EQ(r.imus[0].size(), 100u);
    EXPECT_EQ(r.imus[0].gyro_rad_s[50], Vec3(0.05, 0.2, -0.3));
    EXPECT_TRUE(r.imus[0].accel_m_s2.empty());
  }
}

TEST(CsvLog, TimeUnitsAreFoundFromSpacingAndSaid) {
  const struct {
    std::int64_t step;
    const char* unit;
    std::int64_t to_ns;
  } cases[] = {{10'000'000, "ns", 1}, {10'000, "us", 1000}, {10, "ms", 1'000'000}};
  for (const auto& c : cases) {
    const Recording r = read(gyro_log(",", 77 * c.step, c.step));
    EXPECT_EQ(to_ns(r.imus[0].stamps[3]), 80 * c.step * c.to_ns);
    EXPECT_TRUE(says(r, fmt::format("time taken as {} (from the spacing, 100 Hz)", c.unit))) << all_notes(r);
  }
}

TEST(CsvLog, UnixTimeIsFoundFromMagnitudeAtAnyRate) {
  // One stamp a second would be 1 kHz if it were read as milliseconds.
  const Recording r = read("1700000000.25,0,0,1\n1700000001.25,0,0,1\n1700000002.250000001,0,0,1\n");
  EXPECT_EQ(to_ns(r.imus[0].stamps[2]), 1700000002250000001);
  EXPECT_TRUE(says(r, "time taken as s (from the magnitude: Unix time"));
}

TEST(CsvLog, HeaderAndOptionsOverruleTheSpacing) {
  const Recording slow = read("t_ms,wx,wy,wz\n0,0,0,1\n1000,0,0,1\n2000,0,0,1\n");
  EXPECT_EQ(to_ns(slow.imus[0].stamps[1]), 1'000'000'000);
  const Recording asked = read(gyro_log(",", 0, 10), {.time_unit = TimeUnit::us});
  EXPECT_EQ(to_ns(asked.imus[0].stamps[1]), 10'000);
  EXPECT_TRUE(says(asked, "as asked"));
}

TEST(CsvLog, HeaderNamesAreUnderstood) {
  for (const char* header :
       {"t,wx,wy,wz", "timestamp,gx,gy,gz", "Time,GyroX,GyroY,GyroZ", "time [s],gyro_x,gyro_y,gyro_z",
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]",
        "timestamp,omega_x,omega_y,omega_z", "mcu_time,mcu_x,mcu_y,mcu_z", "\"t\",\"x\",\"y\",\"z\"",
        "t_imu_ns,wx_rad_s,wy_rad_s,wz_rad_s", "stamp,angular_velocity.x,angular_velocity.y,angular_velocity.z"})
    EXPECT_EQ(read(gyro_log(",", 0, 10'000'000, (header + std::string("\n")).c_str())).imus.size(), 1u) << header;
}

TEST(CsvLog, ColumnsAreFoundByNameInAnyOrder) {
  const Recording r = read(
      "az,ay,ax,temperature,wz,wy,wx,mag_x,mag_y,mag_z,t_us\n"
      "9.8,0.2,0.1,25,3,2,1,7,7,7,1000\n9.8,0.2,0.1,25,3,2,1,7,7,7,2000\n");
  EXPECT_EQ(r.imus[0].gyro_rad_s[0], Vec3(1, 2, 3));
  EXPECT_EQ(r.imus[0].accel_m_s2[0], Vec3(0.1, 0.2, 9.8));
  EXPECT_EQ(to_ns(r.imus[0].stamps[1]), 2'000'000);
}

TEST(CsvLog, PlainAxesAreAccelerationsBesideNamedRates) {
  const Recording r = read("Time,X,Y,Z,GyroX,GyroY,GyroZ\n0.00,0,0,1,1,2,3\n0.04,0,0,1,1,2,3\n");
  EXPECT_EQ(r.imus[0].gyro_rad_s[0], Vec3(1, 2, 3));
  EXPECT_NEAR(r.imus[0].accel_m_s2[0].z(), 9.80665, 1e-12);
  EXPECT_TRUE(says(r, "accelerations taken as g"));
}

TEST(CsvLog, PhonesLogs) {
  // Android stamps in ns since the phone was started, or of Unix time; time first or last; one file a sensor.
  for (const std::int64_t first : {std::int64_t{4'512'345'678'901}, std::int64_t{1'700'000'000'123'456'789}})
    for (const char* header :
         {"timestamp,x,y,z", "x,y,z,timestamp", "time,x,y,z", "x,y,z,t_ns", "sensorTimestamp,X,Y,Z",
          "elapsedRealtimeNanos,x,y,z", "timestamp [ns],gyro_x,gyro_y,gyro_z", "", "last"}) {
      const std::string head = header;
      const bool time_last = head.starts_with("x") || head == "last";
      std::string text = head.find(',') == std::string::npos ? "" : head + "\n";
      for (int i = 0; i < 300; ++i) {
        const std::string rates = fmt::format("{:.6f},-0.2,{:.6f}", 0.1 * std::sin(0.05 * i), 0.3 * std::cos(0.1 * i));
        const std::int64_t t = first + i * 5'000'000 + i % 3 * 1000;  // as jumpy as phones are
        text += time_last ? fmt::format("{},{}\n", rates, t) : fmt::format("{},{}\n", t, rates);
      }
      const Recording r = read(text);
      ASSERT_EQ(r.imus.size(), 1u) << head;
      EXPECT_EQ(to_ns(r.imus[0].stamps[0]), first) << head;
      EXPECT_EQ(to_ns(r.imus[0].stamps[299]), first + 299 * 5'000'000 + 2000) << head;
      EXPECT_EQ(r.imus[0].gyro_rad_s[0], Vec3(0, -0.2, 0.3)) << head;
      EXPECT_EQ(says(r, "since nothing says what they are"), head.find("gyro") == std::string::npos) << head;
    }
}

TEST(CsvLog, AnAccelerometersFileIsNotTakenForRates) {
  std::string text = "timestamp,x,y,z\n";
  for (int i = 0; i < 300; ++i) text += fmt::format("{},{:.3f},0.3,9.79\n", i * 5'000'000, 0.4 * std::sin(0.1 * i));
  const std::string why = complaint([&] { (void)read_csv_log(text, "2024/Accelerometer.csv", {}); });
  EXPECT_NE(why.find("holds an accelerometer"), std::string::npos) << why;
  EXPECT_TRUE(says(read(text), "is this an accelerometer's file?"));
  EXPECT_FALSE(says(read_csv_log("t_ns,wx,wy,wz\n0,0,0,9.8\n5000000,0,0,9.8\n", "accel_rig.csv", {}), "accelerometer"));
}

TEST(CsvLog, UnitsMayBePartOfTheColumnsNames) {
  for (const char* unit : {"_mdps", "_mdeg_s", " mdeg/s", "_degps", " (deg/s)", "_rad/s"}) {
    std::string header = "timestamp_us";
    for (const char axis : {'x', 'y', 'z'}) header += fmt::format(",g{}{}", axis, unit);
    EXPECT_EQ(read(header + "\n0,1,2,3\n10000,1,2,3\n").imus.at(0).size(), 2u) << header;
  }
}

TEST(CsvLog, RateUnits) {
  const Recording named = read("t_ns,gx [deg/s],gy [deg/s],gz [deg/s]\n0,180,0,0\n1000000,180,0,0\n");
  EXPECT_DOUBLE_EQ(named.imus[0].gyro_rad_s[0].x(), std::numbers::pi);
  const Recording fast = read("t_ns,gx,gy,gz\n0,90,0,0\n1000000,90,0,0\n");
  EXPECT_DOUBLE_EQ(fast.imus[0].gyro_rad_s[0].x(), std::numbers::pi / 2);
  EXPECT_TRUE(says(fast, "too fast for rad/s"));
  const Recording asked = read("t_ns,gx,gy,gz\n0,90,0,0\n1000000,90,0,0\n", {.rate_unit = RateUnit::rad_s});
  EXPECT_DOUBLE_EQ(asked.imus[0].gyro_rad_s[0].x(), 90);
}

TEST(CsvLog, AnglesByPlaceAndByName) {
  const Recording bare = read("0,0.1\n20000000,0.2\n40000000,0.15\n");
  ASSERT_EQ(bare.angles.size(), 1u);
  EXPECT_EQ(bare.angles[0].angle_rad, (std::vector<double>{0.1, 0.2, 0.15}));
  EXPECT_EQ(to_ns(bare.angles[0].stamps[1]), 20'000'000);
  const Recording degrees = read("t_ns,angle_deg\n0,180\n20000000,90\n");
  EXPECT_DOUBLE_EQ(degrees.angles[0].angle_rad[0], std::numbers::pi);
}

TEST(CsvLog, OrderAndDuplicatesStayAsTheyAre) {
  const Recording r = read("t_ns,wx,wy,wz\n3000000,0,0,1\n1000000,0,0,2\n1000000,0,0,3\n");
  EXPECT_EQ(to_ns(r.imus[0].stamps[0]), 3'000'000);
  EXPECT_EQ(to_ns(r.imus[0].stamps[2]), 1'000'000);
}

TEST(CsvLog, WindowsLineEndsByteOrderMarkAndNoLastLineEnd) {
  const Recording r = read("\xef\xbb\xbft_ns,wx,wy,wz\r\n0,0,0,1\r\n\r\n1000000,0,0,2");
  EXPECT_EQ(r.imus[0].size(), 2u);
  EXPECT_EQ(r.imus[0].gyro_rad_s[1].z(), 2);
}

TEST(CsvLog, BadInputIsOneLineThatNamesTheLine) {
  const struct {
    const char* text;
    const char* expected;
  } cases[] = {
      {"", "log.csv: is empty"},
      {"\n\n", "log.csv: is empty"},
      {"t,wx,wy,wz\n", "log.csv: has no row of numbers"},
      {"t_ns,wx,wy,wz\n0,1,2,3\n1000000,1,2\n", "log.csv:3: row has 3 columns, 4 expected; the last row is cut off"},
      {"t_ns,wx,wy,wz\n0,1,2\n", "log.csv:2: row has 3 columns, its header 4"},
      {"0,1,2,3\n1000000,1,nan,3\n", "log.csv:2: column 3 is 'nan', not a finite number"},
      {"0,1,2,3\n1000000,1,1e999,3\n", "log.csv:2: column 3 is '1e999'"},
      {"0,1,2,3\n1000000,1,two,3\n2000000,1,2,3\n", "log.csv:2: column 3 is 'two'"},
      {"t_ns,wx,wy,wz\n99999999999999999999,1,2,3\n",
       "log.csv:2: column 1 (t_ns) is '99999999999999999999', not a stamp"},
      {"t_ns,wx,wy,wz\n0,1,2,3\n\n1000000,1,2,3,4\n", "log.csv:4: row has 5 columns, 4 expected"},
      {"a,b,c,d\n0,1,2,3\n", "names no time column"},
      {"t,px,py,pz\n0,1,2,3\n", "neither three rates nor an angle"},
      {"5,2,3\n6,3,4\n", "3 columns without a header"},
      {"1\n2\n", "one column only"},
  };
  for (const auto& c : cases) {
    const std::string said = complaint([&] { (void)read(c.text); });
    EXPECT_NE(said.find(c.expected), std::string::npos) << c.text << " -> " << said;
  }
  EXPECT_NE(complaint([&] { (void)read(std::string("0,1\0\xff\x01", 6)); }).find("is binary"), std::string::npos);
  EXPECT_NE(complaint([&] { (void)read_csv_log("no/such/file.csv", OpenOptions{}); }).find("cannot be read"),
            std::string::npos);
}

TEST(CsvLog, RealPhoneAndMicrocontroller) {
  TAKT_NEEDS_REAL_DATA("phone_mcu_gyro");
  const Recording mcu = open_recording(real_data("phone_mcu_gyro/mcu_gyro_data.csv"));
  const Recording phone = open_recording(real_data("phone_mcu_gyro/smartphone_gyro_data.csv"));
  ASSERT_EQ(mcu.imus.at(0).size(), 4883u);
  ASSERT_EQ(phone.imus.at(0).size(), 4883u);
  EXPECT_EQ(mcu.imus[0].name, "mcu_gyro_data");
  EXPECT_EQ(to_ns(mcu.imus[0].stamps[0]), 1264250902773);
  EXPECT_EQ(to_ns(phone.imus[0].stamps[0]), 949113215987860);
  EXPECT_DOUBLE_EQ(mcu.imus[0].gyro_rad_s[0].y(), -0.003865038290103);
  EXPECT_TRUE(says(mcu, "time taken as s (from the spacing, 500 Hz)")) << all_notes(mcu);
  EXPECT_TRUE(says(mcu, "rates taken as rad/s"));
}

TEST(CsvLog, RealRaceLogger) {
  TAKT_NEEDS_REAL_DATA("hero8_racebox");
  const Recording r = open_recording(real_data("hero8_racebox/5f2167b0-racebox.csv"));
  const ImuStream& imu = r.imus.at(0);
  ASSERT_EQ(imu.size(), 19060u);
  EXPECT_EQ(to_ns(imu.stamps[1]), 40'000'000);
  EXPECT_NEAR(imu.gyro_rad_s[0].x(), -2.98 * std::numbers::pi / 180, 1e-15);
  EXPECT_NEAR(imu.accel_m_s2[0].z(), 0.990 * 9.80665, 1e-12);
  EXPECT_TRUE(says(r, "rates taken as deg/s")) << all_notes(r);
}

TEST(CsvLog, RealPhoneWithTimeLast) {
  TAKT_NEEDS_REAL_DATA("phone_rolling_shutter");
  const Recording r = open_recording(real_data("phone_rolling_shutter/gyro.txt"));
  const ImuStream& imu = r.imus.at(0);
  ASSERT_EQ(imu.size(), 29466u);
  EXPECT_EQ(to_ns(imu.stamps[0]), 4328040426741000);
  EXPECT_DOUBLE_EQ(imu.gyro_rad_s[0].y(), 3.833799999999999708e-02);
  EXPECT_TRUE(says(r, "time in column 4")) << all_notes(r);
}

TEST(CsvLog, RealFilesCutAnywhereReadOrSayWhy) {
  TAKT_NEEDS_REAL_DATA("phone_mcu_gyro");
  const std::string text = read_file(real_data("phone_mcu_gyro/mcu_gyro_data.csv")).substr(0, 20000);
  for (std::size_t length = 0; length < text.size(); length += 97) {
    const std::string said = complaint([&] { EXPECT_GT(read(text.substr(0, length)).imus.at(0).size(), 0u); });
    EXPECT_TRUE(length <= 200 || said.empty() || said.find("log.csv:") != std::string::npos) << said;
  }
}

// One hour at 400 Hz, 95 MB. CPU time, so that a busy machine does not matter; sanitizers are allowed to be slow.
TEST(CsvLog, AnHourIsReadInUnderASecond) {
  std::string text = "t_ns,wx,wy,wz\n";
  for (int i = 0; i < 1'440'000; ++i)
    text +=
        fmt::format("{},{:.12f},{:.12f},{:.12f}\n", 1700000000000000000 + i * 2'500'000LL, 0.1 + i * 1e-7, -0.2, 0.3);
  const std::clock_t start = std::clock();
  const Recording r = read(text);
  const double took_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  EXPECT_EQ(r.imus[0].size(), 1'440'000u);
  RecordProperty("cpu_seconds", std::to_string(took_s));
#ifndef TAKT_SANITIZED
  EXPECT_LT(took_s, 0.7);
#endif
}

TEST(CsvLog, BetaflightCountsItsAxes) {
  const Recording r = read_csv_log(
      "loopIteration,time (us),axisP[0],axisP[1],axisP[2],gyroADC[0] (deg/s),gyroADC[1] (deg/s),gyroADC[2] (deg/s),"
      "motor[0]\n1,1000000,0,0,0,180,0,90,7\n2,1000500,0,0,0,180,0,90,7\n",
      "LOG00001.01.csv", {});
  ASSERT_EQ(r.imus.size(), 1u);
  EXPECT_EQ(to_ns(r.imus[0].stamps.at(1)), 1'000'500'000);
  EXPECT_NEAR(r.imus[0].gyro_rad_s.at(0).z(), 1.5707963, 1e-6);
}

}  // namespace
}  // namespace takt
