// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/rosbag2.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <tuple>

#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "tests/db3_writing.h"
#include "tests/mcap_writing.h"
#include "tests/tools.h"

namespace takt {
namespace {

using db3_writing::Database;
using mcap_writing::compressed;
using mcap_writing::image;
using mcap_writing::imu;
using testing_tools::complaint;
using testing_tools::TemporaryFolder;

/// A camera and an IMU; `from` is the second at which it starts.
void fill(Database& db, int from, const std::string& compression = "") {
  db.topic(1, "/imu", "sensor_msgs/msg/Imu");
  db.topic(2, "/cam/image_raw", "sensor_msgs/msg/Image");
  db.run("BEGIN");
  for (int i = 0; i < 3; ++i) {
    db.message(1, 100 + i, compressed(imu(from, static_cast<std::uint32_t>(i), 0.1 * i, 1), compression));
    db.message(2, 200 + i,
               compressed(image(from, static_cast<std::uint32_t>(i), 300, 10, std::string(3000, 'a')), compression));
  }
  db.run("COMMIT");
}

TEST(Db3, OldAndNewSchemaAndMessagesCompressedOneByOne) {
  const TemporaryFolder folder;
  for (const bool new_schema : {false, true})
    for (const char* compression : {"", "zstd"}) {
      const std::string path = folder.path() + "/run" + compression + (new_schema ? "n" : "o") + ".db3";
      {
        Database db(path, new_schema);
        fill(db, 5, compression);
      }
      const Recording r = open_recording(path);
      EXPECT_EQ(r.format, "rosbag2 database");
      ASSERT_EQ(r.imus.size(), 1u);
      EXPECT_EQ(r.imus[0].size(), 3u);
      EXPECT_EQ(to_ns(r.imus[0].stamps[2]), 5'000'000'002);
      EXPECT_EQ(to_ns(r.imus[0].arrivals[2]), 102);
      EXPECT_DOUBLE_EQ(r.imus[0].gyro_rad_s[2].x(), 0.2);
      ASSERT_EQ(r.cameras.size(), 1u);
      EXPECT_EQ(r.cameras[0].size(), 3u);
      const auto frame = r.cameras[0].open()->next();
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->image.row(9)[299], 'a');
    }
}

TEST(Db3, WhatIsNoneOrBrokenSaysSo) {
  const TemporaryFolder folder;
  EXPECT_NE(complaint([&] { (void)open_recording(folder.file("a.db3", "no database at all, but long enough")); }), "");
  const std::string path = folder.path() + "/other.db3";
  {
    Database db(path);
    db.run("DROP TABLE messages");
  }
  EXPECT_NE(complaint([&] { (void)open_recording(path); }).find("is no rosbag2 database"), std::string::npos);
  const std::string whole = folder.path() + "/whole.db3";
  {
    Database db(whole);
    fill(db, 5);
  }
  const std::string bytes = read_file(whole);
  for (std::size_t i = 0; i < 20; ++i) {
    const std::string part = bytes.substr(0, bytes.size() * i / 20);
    complaint([&] { (void)read_db3(std::as_bytes(std::span(part)), "part.db3"); });
  }
}

std::string metadata(const std::vector<std::string>& files) {
  std::string text =
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n";
  for (const std::string& f : files) text += "    - " + f + "\n";
  return text;
}

TEST(Rosbag2, AFolderOfSeveralFilesIsOneRecording) {
  const TemporaryFolder folder;
  const std::string in = folder.path() + "/run", out = folder.path() + "/out";
  std::filesystem::create_directories(in);
  {
    Database first(in + "/run_0.db3"), second(folder.path() + "/run_1.db3");
    fill(first, 5);
    fill(second, 6);
  }
  std::ignore = folder.file("run/run_1.db3.zstd", compressed(read_file(folder.path() + "/run_1.db3"), "zstd"));
  std::ignore = folder.file("run/metadata.yaml", metadata({"run_0.db3", "run_1.db3.zstd"}));
  const Recording r = open_recording(in);
  EXPECT_EQ(r.format, "rosbag2 folder");
  ASSERT_EQ(r.imus.size(), 1u);
  EXPECT_EQ(r.imus[0].size(), 6u);
  ASSERT_EQ(r.cameras.size(), 1u);
  EXPECT_EQ(r.cameras[0].size(), 6u);
  const auto frames = r.cameras[0].open();
  frames->skip_to(4);
  const auto frame = frames->next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->index, 4u);
  EXPECT_EQ(to_ns(frame->stamp), 6'000'000'001);

  const Restamped done = restamp_recording(
      in, out,
      {.stream = "/cam/image_raw", .map = [](Stamp t) { return t + Duration(1'000'000'000); }, .now_means = {}});
  ASSERT_EQ(done.streams.size(), 1u);
  EXPECT_EQ(done.streams[0].count, 6u);
  const Recording moved = open_recording(out);
  EXPECT_EQ(to_ns(moved.cameras.at(0).stamps.at(5)), 7'000'000'002);
  EXPECT_EQ(moved.imus.at(0).stamps, r.imus[0].stamps);
  EXPECT_EQ(moved.imus[0].gyro_rad_s, r.imus[0].gyro_rad_s);
  EXPECT_EQ(read_file(out + "/metadata.yaml"), read_file(in + "/metadata.yaml"));
}

}  // namespace
}  // namespace takt
