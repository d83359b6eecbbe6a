// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/telemetry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/recording/gopro.h"
#include "tests/gpmf_writing.h"

namespace takt {
namespace {

using namespace gpmf_writing;

constexpr std::int64_t payload_ns = 1'001'000'000;
constexpr int blocks = 12, rows = 200, frames = 30;
constexpr double gyro_period_us = 5005.0;           // just 200 in a payload
constexpr std::int64_t camera_zero_us = 7'000'000;  // of the camera's clock, at the start of the first frame
constexpr std::int64_t gyro_lead_us = 5'030;        // the first gyro sample comes that much before it

std::string stream(const std::string& key, int block, int count, std::int64_t stamp_us, const std::string& data) {
  return nest("STRM", u64("STMP", static_cast<std::uint64_t>(stamp_us)) +
                          u32("TSMP", static_cast<std::uint32_t>((block + 1) * count)) + text("STNM", key) + data);
}

/// A camera whose µs clock runs as the video does; the gyro's columns count samples, so that none can be mixed up.
MediaIndex::Payload made_payload(int k) {
  std::vector<std::int16_t> gyro;
  for (int i = 0; i < rows; ++i)
    for (int column = 0; column < 3; ++column) gyro.push_back(static_cast<std::int16_t>(10 * (k * rows + i) + column));
  const std::int64_t frame_us = camera_zero_us + k * payload_ns / 1000;
  const std::int64_t gyro_us = camera_zero_us - gyro_lead_us + std::llround(k * rows * gyro_period_us);
  const std::string inside = text("DVNM", "made") + stream("GYRO", k, rows, gyro_us, s16("GYRO", 3, gyro)) +
                             stream("SHUT", k, frames, frame_us, f32("SHUT", 1, std::vector<float>(frames, 0.005F)));
  return {from_ns(k * payload_ns), Duration(payload_ns), nest("DEVC", inside)};
}

std::vector<MediaIndex::Payload> made_payloads() {
  std::vector<MediaIndex::Payload> out;
  for (int k = 0; k < blocks; ++k) out.push_back(made_payload(k));
  return out;
}

double ns(Stamp t) {
  return static_cast<double>(to_ns(t));
}

TEST(Telemetry, StampsFollowTheCamerasClock) {
  const Telemetry telemetry(made_payloads());
  const auto gyro = telemetry.table("GYRO", 3);
  ASSERT_TRUE(gyro);
  ASSERT_EQ(gyro->rows(), static_cast<std::size_t>(blocks * rows));
  for (std::size_t i = 0; i < gyro->rows(); ++i) {
    EXPECT_EQ(gyro->row(i)[1], static_cast<double>(10 * i + 1));
    // The stamps themselves are whole microseconds.
    EXPECT_NEAR(ns(gyro->stamps[i]), -1000.0 * gyro_lead_us + 1000 * gyro_period_us * static_cast<double>(i), 1000);
  }
}

TEST(Telemetry, ALostPayloadLeavesItsSamplesOutAndNothingElseMoves) {
  auto payloads = made_payloads();
  payloads.erase(payloads.begin() + 5);
  const auto gyro = Telemetry(payloads).table("GYRO", 3);
  ASSERT_TRUE(gyro);
  ASSERT_EQ(gyro->rows(), static_cast<std::size_t>((blocks - 1) * rows));
  EXPECT_NEAR(ns(gyro->stamps.back()), -1000.0 * gyro_lead_us + 1000 * gyro_period_us * (blocks * rows - 1), 1000);
  EXPECT_NEAR(static_cast<double>((gyro->stamps[5 * rows] - gyro->stamps[5 * rows - 1]).count()),
              1000 * gyro_period_us * (rows + 1), 10);
}

TEST(Telemetry, ADamagedPayloadIsSaidAndSkipped) {
  auto payloads = made_payloads();
  payloads[3].bytes.resize(100);
  const Telemetry telemetry(payloads);
  ASSERT_FALSE(telemetry.notes().empty());
  EXPECT_NE(telemetry.notes()[0].find("1 of 12 telemetry payloads are damaged"), std::string::npos)
      << telemetry.notes()[0];
  EXPECT_EQ(telemetry.table("GYRO", 3)->rows(), static_cast<std::size_t>((blocks - 1) * rows));
}

TEST(Telemetry, WithoutAClockThePayloadsTellTheTime) {
  auto payloads = made_payloads();
  for (auto& p : payloads)
    for (std::size_t at; (at = p.bytes.find("STMP")) != std::string::npos;) p.bytes.replace(at, 4, "xxxx");
  const auto gyro = Telemetry(payloads).table("GYRO", 3);
  ASSERT_TRUE(gyro);
  EXPECT_NEAR(ns(gyro->stamps[0]), 0, 1000);
  EXPECT_NEAR(ns(gyro->stamps.back()), 1000 * gyro_period_us * (blocks * rows - 1), 1000);
  EXPECT_NE(gyro->note.find("times of the payloads"), std::string::npos) << gyro->note;
}

TEST(Telemetry, NothingThereIsNothing) {
  EXPECT_FALSE(Telemetry({}).table("GYRO", 3));
  EXPECT_FALSE(Telemetry(made_payloads()).table("GYRO", 4));
  EXPECT_TRUE(read_telemetry(Telemetry({})).imus.empty());
}

TEST(Telemetry, AxesGoByWhatTheCameraSays) {
  gpmf::Stream s;
  const Vec3 stored(1, 2, 3);
  EXPECT_EQ(stored_axes(s).body_from_stored * stored, Vec3(2, 3, 1)) << "Z X Y where nothing is said";
  s.name = "Gyroscope (x,z,y)";
  EXPECT_EQ(stored_axes(s).body_from_stored * stored, Vec3(1, 3, 2));
  s.matrix = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  s.output_axes = "ZXY";
  EXPECT_EQ(stored_axes(s).body_from_stored * stored, Vec3(1, 3, -2));
  s.stored_axes = "zxY";
  EXPECT_EQ(stored_axes(s).body_from_stored * stored, Vec3(-2, 3, -1));
  s.stored_axes = "XXY";  // no permutation: the next best source
  EXPECT_EQ(stored_axes(s).body_from_stored * stored, Vec3(1, 3, -2));
}

// ORIN and MTRX of a GoPro Max say the same.
TEST(Telemetry, OrinAndMatrixAgree) {
  gpmf::Stream by_letters, by_matrix;
  by_letters.stored_axes = "XzY";
  by_matrix.matrix = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  by_matrix.output_axes = "ZXY";
  EXPECT_EQ(stored_axes(by_letters).body_from_stored, stored_axes(by_matrix).body_from_stored);
}

}  // namespace
}  // namespace takt
