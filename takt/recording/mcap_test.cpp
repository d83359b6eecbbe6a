// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap.h"

#include <gtest/gtest.h>

#include "takt/recording/open_recording.h"
#include "tests/mcap_writing.h"
#include "tests/tools.h"

namespace takt {
namespace {

using namespace mcap_writing;
using testing_tools::complaint;
using testing_tools::TemporaryFolder;

Recording read(const std::string& bytes) {
  return read_mcap(view_bytes(std::as_bytes(std::span(bytes))), "run.mcap");
}
std::string joined(const std::vector<std::string>& notes) {
  std::string all;
  for (const std::string& n : notes) all += n + "\n";
  return all;
}
const std::string channels = schema(1, "sensor_msgs/msg/Imu") + channel(1, 1, "/imu") +
                             schema(2, "sensor_msgs/msg/Image") + channel(2, 2, "/cam/image_raw");
std::string camera_and_imu(const std::string& compression) {
  return file(chunk(channels + message(1, 7, imu(-3, 5, 0.1, 0.4)) +
                        message(2, 8, image(17, 250'000'000, 2, 2, "\x01\x02\x03\x04")),
                    compression) +
              chunk(message(2, 9, image(18, 0, 2, 2, "\x05\x06\x07\x08")), compression));
}

TEST(Mcap, CdrInEveryCompression) {
  for (const char* compression : {"", "lz4", "zstd"}) {
    const std::string bytes = camera_and_imu(compression);
    const Recording r = read(bytes);
    ASSERT_EQ(r.imus.size(), 1u) << compression << joined(r.notes);
    EXPECT_EQ(to_ns(r.imus[0].stamps.at(0)), -2'999'999'995);
    EXPECT_EQ(to_ns(r.imus[0].arrivals.at(0)), 7);
    EXPECT_EQ(r.imus[0].gyro_rad_s.at(0), Vec3(0.1, 0.2, 0.3));
    EXPECT_EQ(r.imus[0].accel_m_s2.at(0), Vec3(0.4, 0.5, 9.8));
    ASSERT_EQ(r.cameras.size(), 1u);
    EXPECT_EQ(to_ns(r.cameras[0].stamps.at(0)), 17'250'000'000);
    const auto frames = r.cameras[0].open();
    EXPECT_EQ(frames->next()->image.row(1)[0], 3);
    EXPECT_EQ(frames->next()->image.row(1)[1], 8);
    EXPECT_FALSE(frames->next());
    EXPECT_EQ(frames->broken(), 0u);
  }
}

TEST(Mcap, JsonAsRosAndAsFoxglove) {
  const std::string ros = R"({"header":{"stamp":{"sec":3,"nanosec":4}},"angular_velocity":{"x":1,"y":2,"z":3},)"
                          R"("linear_acceleration":{"x":4,"y":5,"z":6}})";
  const std::string foxglove =
      R"({"timestamp":{"sec":5,"nsec":6},"width":2,"height":1,"encoding":"mono8","step":2,"data":"Bwg="})";
  const std::string bytes =
      file(schema(1, "sensor_msgs/Imu", "jsonschema") + channel(1, 1, "/imu", "json") + message(1, 1, ros) +
           schema(2, "foxglove.RawImage", "jsonschema") + channel(2, 2, "/cam", "json") + message(2, 1, foxglove));
  const Recording r = read(bytes);
  EXPECT_EQ(to_ns(r.imus.at(0).stamps.at(0)), 3'000'000'004);
  EXPECT_EQ(r.imus[0].accel_m_s2.at(0), Vec3(4, 5, 6));
  EXPECT_EQ(to_ns(r.cameras.at(0).stamps.at(0)), 5'000'000'006);
  EXPECT_EQ(r.cameras[0].open()->next()->image.row(0)[1], 8);
}

TEST(Mcap, CutOffAnywhereItGivesWhatStoodBefore) {
  for (const char* compression : {"", "lz4", "zstd"}) {
    const std::string whole = camera_and_imu(compression);
    std::size_t most = 0;
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const std::string part = whole.substr(0, size);
      const std::string said = complaint([&] {
        const Recording r = read(part);
        const std::size_t frames = r.cameras.empty() ? 0 : r.cameras[0].size();
        EXPECT_GE(frames, most);
        EXPECT_TRUE(size + 40 > whole.size() || !r.notes.empty());
        most = frames;
      });
      EXPECT_TRUE(!said.empty() || most > 0 || size > 200) << size;
    }
    EXPECT_EQ(most, 2u) << compression;
  }
}

TEST(Mcap, AWrongChecksumIsFound) {
  std::string bytes = camera_and_imu("lz4");
  const std::size_t chunk_at = magic.size() + header().size();
  bytes[chunk_at + 9 + 24] = static_cast<char>(bytes[chunk_at + 9 + 24] + 1);
  EXPECT_NE(complaint([&] { (void)read(bytes); }).find("fail their checksum"), std::string::npos);
}

TEST(Mcap, HugeClaimsCostNothing) {
  const std::string chunk = record(6, std::string(16, '\0') + raw(std::uint64_t{1} << 60) + raw(std::uint32_t{0}) +
                                          sized("zstd") + raw(std::uint64_t{4}) + "abcd");
  EXPECT_NE(complaint([&] { (void)read(file(chunk)); }), "");
  const std::string cut = magic + std::string(1, '\5') + raw(UINT64_MAX);
  EXPECT_NE(complaint([&] { (void)read(cut); }).find("cut off"), std::string::npos);
}

TEST(Mcap, OtherFilesAreRefused) {
  EXPECT_NE(complaint([] { (void)read(""); }).find("is no MCAP file"), std::string::npos);
  EXPECT_NE(complaint([] { (void)read(file("")); }).find("has no messages"), std::string::npos);
  EXPECT_NE(complaint([] {
              (void)read(file(schema(1, "std_msgs/msg/String") + channel(1, 1, "/a") + message(1, 1, "x")));
            }).find("only std_msgs/String"),
            std::string::npos);
}

}  // namespace
}  // namespace takt
