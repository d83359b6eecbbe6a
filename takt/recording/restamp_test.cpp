// SPDX-License-Identifier: Apache-2.0
// Every format that can be written: nothing changes with an offset of 0, and only the stamps do with another.
#include "takt/recording/restamp.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <tuple>

#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "tests/db3_writing.h"
#include "tests/mcap_writing.h"
#include "tests/ros1_bag_writing.h"
#include "tests/tools.h"

namespace takt {
namespace {

namespace bag = bag_writing;
namespace mc = mcap_writing;
using testing_tools::complaint;
using testing_tools::real_data;
using testing_tools::TemporaryFolder;

constexpr Duration shift(1'234'567'891);

Restamping moving(const std::string& stream, Duration by) {
  return {.stream = stream, .map = [by](Stamp t) { return t + by; }, .now_means = {}};
}
Stamp stamp_of(const Recording& r, std::size_t i) {
  return r.cameras.at(0).stamps.at(i);
}
std::size_t bytes_that_differ(const std::string& a, const std::string& b) {
  EXPECT_EQ(a.size(), b.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) count += a[i] != b[i];
  return count;
}

std::string ros1_file(const std::string& compression) {
  const std::string imu_message = bag::header(1, 2) + std::string(296, '\1');
  return bag::bag(bag::chunk(bag::connection(1, "/cam/image_raw", "sensor_msgs/Image") +
                                 bag::connection(2, "/imu", "sensor_msgs/Imu") +
                                 bag::message(1, bag::image(17, 2, 2, "mono8", 2, "abcd")) +
                                 bag::message(2, imu_message),
                             compression) +
                  bag::chunk(bag::message(2, imu_message) + bag::message(1, bag::image(18, 2, 2, "mono8", 2, "efgh")),
                             compression));
}
std::string mcap_file(const std::string& compression) {
  return mc::file(mc::chunk(mc::schema(1, "sensor_msgs/msg/Imu") + mc::channel(1, 1, "/imu") +
                                mc::schema(2, "sensor_msgs/msg/Image") + mc::channel(2, 2, "/cam/image_raw") +
                                mc::message(1, 7, mc::imu(17, 5, 0.1, 0.4)) +
                                mc::message(2, 8, mc::image(17, 5, 2, 2, "abcd")),
                            compression) +
                  mc::message(2, 9, mc::image(18, 5, 2, 2, "efgh")));
}

TEST(Restamp, ContainersKeepEveryOtherByte) {
  const TemporaryFolder folder;
  std::vector<std::string> files;
  for (const char* c : {"none", "lz4", "bz2"}) files.push_back(folder.file(std::string(c) + ".bag", ros1_file(c)));
  for (const char* c : {"", "lz4", "zstd"}) files.push_back(folder.file(std::string(c) + "x.mcap", mcap_file(c)));
  files.push_back(folder.path() + "/run.db3");
  {
    db3_writing::Database db(files.back());
    db.topic(1, "/imu", "sensor_msgs/msg/Imu");
    db.topic(2, "/cam/image_raw", "sensor_msgs/msg/Image");
    db.message(1, 7, mc::imu(17, 5, 0.1, 0.4));
    db.message(2, 8, mc::image(17, 5, 2, 2, "abcd"));
    db.message(2, 9, mc::image(18, 5, 2, 2, "efgh"));
  }
  for (const std::string& in : files) {
    const std::string same = in + ".same", moved = in + ".moved";
    static_cast<void>(restamp_recording(in, same, moving("/cam/image_raw", Duration(0))));
    EXPECT_EQ(read_file(same), read_file(in)) << in;
    const Restamped done = restamp_recording(in, moved, moving("/cam/*", shift));
    ASSERT_EQ(done.streams.size(), 1u) << in;
    EXPECT_EQ(done.streams[0].count, 2u) << in;
    EXPECT_EQ(done.streams[0].latest_after - done.streams[0].latest_before, shift);
    const Recording before = open_recording(in), after = open_recording(moved);
    EXPECT_EQ(after.notes, before.notes) << in;
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      EXPECT_EQ(stamp_of(after, i), stamp_of(before, i) + shift) << in;
      EXPECT_EQ(after.cameras[0].arrivals[i], before.cameras[0].arrivals[i]) << in;
    }
    EXPECT_EQ(after.imus.at(0).stamps, before.imus.at(0).stamps) << in;
    const auto pictures = after.cameras[0].open();
    EXPECT_EQ(pictures->next()->image.row(1)[1], 'd') << in;
    EXPECT_EQ(pictures->next()->image.row(1)[1], 'h') << in;
    // And back again: the same bytes, apart from how they are compressed and from the database's change counter.
    const std::string back = in + ".back";
    static_cast<void>(restamp_recording(moved, back, moving("/cam/image_raw", -shift)));
    const bool plain = in.find("none.bag") != std::string::npos || in.find("/x.mcap") != std::string::npos;
    if (plain) {
      EXPECT_EQ(read_file(back), read_file(in)) << in;
    }
    if (in.ends_with(".db3")) {
      EXPECT_LE(bytes_that_differ(read_file(back), read_file(in)), 16u);
    }
  }
}

TEST(Restamp, CameraInfoGoesWithItsPictures) {
  const TemporaryFolder folder;
  const std::string in =
      folder.file("run.bag", bag::bag(bag::chunk(bag::connection(1, "/cam/image_raw", "sensor_msgs/Image") +
                                                 bag::connection(2, "/cam/camera_info", "sensor_msgs/CameraInfo") +
                                                 bag::message(1, bag::image(17, 2, 2, "mono8", 2, "abcd")) +
                                                 bag::message(2, bag::header(17, 5) + std::string(200, '\0')))));
  const Restamped done = restamp_recording(in, in + ".out", moving("/cam/image_raw", shift));
  ASSERT_EQ(done.streams.size(), 2u);
  EXPECT_EQ(done.streams[0].earliest_after, done.streams[1].earliest_after);
  EXPECT_EQ(done.notes, std::vector<std::string>{"/cam/camera_info goes with /cam/image_raw"});
}

TEST(Restamp, RehearsalWritesNothingAndSaysTheSame) {
  const TemporaryFolder folder;
  const std::string in = folder.file("run.bag", ros1_file("lz4"));
  const Restamped dry = restamp_recording(in, "", moving("/cam/image_raw", shift));
  EXPECT_EQ(dry.streams.at(0).count, 2u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), std::filesystem::directory_iterator()),
            1);
}

TEST(Restamp, RecordTimesMoveOnlyWhenAsked) {
  const TemporaryFolder folder;
  for (const std::string& in : {folder.file("run.mcap", mcap_file("zstd")), folder.file("run.bag", ros1_file("lz4"))}) {
    Restamping order = moving("/cam/image_raw", shift);
    order.record_time = true;
    static_cast<void>(restamp_recording(in, in + ".out", order));
    const Recording before = open_recording(in), after = open_recording(in + ".out");
    EXPECT_EQ(after.cameras.at(0).arrivals.at(0), before.cameras.at(0).arrivals.at(0) + shift);
    EXPECT_EQ(after.imus.at(0).arrivals, before.imus.at(0).arrivals);
  }
}

TEST(Restamp, JsonMayChangeItsLength) {
  const std::string imu = R"({"a":"\"}{","header":{"stamp":{"sec":9,"nanosec":0}},"angular_velocity":)"
                          R"({"x":1,"y":2,"z":3}})";
  const TemporaryFolder folder;
  const std::string in = folder.file("run.mcap", mc::file(mc::chunk(mc::schema(1, "sensor_msgs/Imu", "jsonschema") +
                                                                        mc::channel(1, 1, "/imu", "json") +
                                                                        mc::message(1, 1, imu) + mc::message(1, 2, imu),
                                                                    "zstd")));
  static_cast<void>(restamp_recording(in, in + ".out", moving("/imu", shift)));
  const Recording r = open_recording(in + ".out");
  EXPECT_EQ(to_ns(r.imus.at(0).stamps.at(1)), 10'234'567'891);
  EXPECT_TRUE(r.notes.empty());
}

TEST(Restamp, WhatDoesNotFitIsRefused) {
  const TemporaryFolder folder;
  const std::string in = folder.file("run.bag", ros1_file("none"));
  EXPECT_NE(
      complaint([&] {
        static_cast<void>(restamp_recording(in, in + ".out", moving("/cam/image_raw", Duration(-60'000'000'000))));
      }).find("cannot hold"),
      std::string::npos);
  EXPECT_NE(complaint([&] {
              static_cast<void>(restamp_recording(in, "", moving("/nobody", shift)));
            }).find("it has: /cam/image_raw, /imu"),
            std::string::npos);
}

TEST(Restamp, TablesKeepTheirTextAndTheirUnit) {
  const TemporaryFolder folder;
  const auto restamped = [&](const std::string& text, Duration by) {
    const std::string in = folder.file("gyro.csv", text);
    static_cast<void>(restamp_recording(in, in + ".out", moving("gyro", by)));
    return read_file(in + ".out");
  };
  const std::string log =
      "# a remark\r\ntime [s] , wx, wy, wz\r\n 1.50 ,0.1,2e-1,0.3\r\n\r\n1.51,1,2,3\r\n# more\r\n1.52,1,2,3";
  EXPECT_EQ(restamped(log, Duration(0)), log);
  EXPECT_EQ(restamped(log, Duration(250'000'000)),
            "# a remark\r\ntime [s] , wx, wy, wz\r\n 1.75 ,0.1,2e-1,0.3\r\n\r\n1.76,1,2,3\r\n# more\r\n1.77,1,2,3");
  EXPECT_EQ(restamped(log, Duration(1)),
            "# a remark\r\ntime [s] , wx, wy, wz\r\n 1.500000001 ,0.1,2e-1,0.3\r\n\r\n1.510000001,1,2,3\r\n# more\r\n"
            "1.520000001,1,2,3");
  EXPECT_EQ(restamped("wx wy wz t_ms\n1 2 3  100\n1 2 3  110\n", Duration(3'177'000)),
            "wx wy wz t_ms\n1 2 3  103.177\n1 2 3  113.177\n");
}

/// Every file of a folder, or the file itself, by its name.
std::map<std::string, std::string> contents(const std::string& path) {
  namespace fs = std::filesystem;
  if (!fs::is_directory(path)) return {{"", read_file(path)}};
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) all[fs::relative(entry.path(), path).generic_string()] = read_file(entry.path());
  return all;
}
std::vector<Stamp> stamps_of(const Recording& r, const std::string& stream) {
  for (const ImuStream& imu : r.imus)
    if (imu.name == stream) return imu.stamps;
  for (const CameraStream& camera : r.cameras)
    if (camera.name == stream) return camera.stamps;
  return {};
}

TEST(Restamp, LogsAndFoldersOfOtherToolsMoveThereAndBack) {
  const TemporaryFolder folder;
  const std::string picture = "P5\n2 2\n255\nabcd", at = folder.path() + "/";
  struct Case {
    std::string path;
    std::vector<std::string> streams;
  };
  std::vector<Case> cases;
  cases.push_back({folder.file("clip.gcsv",
                               "GYROFLOW IMU LOG\r\nversion,1.3\r\ntscale,0.001\r\ngscale,0.5\r\nt,gx,gy,gz\r\n"
                               "1.5,1,2,3\r\n2.25,4,5,6\r\n"),
                   {"clip"}});
  cases.push_back(
      {folder.file("phone.csv", "timestamp,x,y,z\n100000000,1,2,3\n110000000,2,3,4\n120000000,1,2,3\n"), {"phone"}});
  cases.push_back({folder.file("wing.csv",
                               "loopIteration,time,gyroADC[0],gyroADC[1],gyroADC[2]\n0,100000,10,20,30\n"
                               "1,101000,40,50,60\n2,102000,10,20,30\n"),
                   {"wing"}});
  for (const char* name : {"1385030208726607488.pgm", "1385030208776607488.pgm", "notes.pgm"})
    std::ignore = folder.file(std::string("kalibr/cam0/") + name, picture);
  std::ignore = folder.file("kalibr/imu0.csv",
                            "timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z\n1385030208726607500,0.5,-0.1,"
                            "0.02,9.1,0.2,-3.2\n1385030208731607500,0.6,-0.1,0.02,9.1,0.2,-3.2\n");
  std::ignore = folder.file("kalibr/readme.txt", "a rig");
  cases.push_back({at + "kalibr", {"cam0", "imu0"}});
  for (const char* name : {"image_00/data/0000000000.png", "image_00/data/0000000001.png"})
    std::ignore = folder.file(std::string("kitti/") + name, picture);
  std::ignore = folder.file("kitti/image_00/timestamps.txt",
                            "2011-12-31 23:59:58.900000000\r\n\r\n2011-12-31 23:59:59.950000000\r\n");
  std::ignore = folder.file("kitti/image_00/data/0000000002.png", picture);
  std::string row = "0";
  for (int i = 1; i < 30; ++i) row += " " + std::to_string(i);
  for (const char* name : {"0000000000.txt", "0000000001.txt"})
    std::ignore = folder.file(std::string("kitti/oxts/data/") + name, row);
  std::ignore = folder.file("kitti/oxts/timestamps.txt", "2011-12-31 23:59:58.5\n2011-12-31 23:59:59");
  cases.push_back({at + "kitti", {"image_00", "oxts_imu"}});
  for (const char* name : {"f-1.png", "f-2.png"})
    std::ignore = folder.file(std::string("phone/frames/") + name, picture);
  std::ignore = folder.file("phone/framestamp.txt", "4328.040426\n4328.073739\n");
  std::ignore = folder.file("phone/gyro.txt", "0.1,0.2,0.3,4328.04\n0.1,0.2,0.3,4328.05\n");
  std::ignore = folder.file("phone/gyro_dump.txt",
                            "SOF  4328040426,  frameNum :1 exp time 0.005\nframeid:1 gyro:0 x 1 ts 4328040741\n"
                            "SOF  4328073739,  frameNum :2 exp time 0.006\n");
  cases.push_back({at + "phone", {"cam0", "imu0"}});

  constexpr Duration whole(1'234'567'000);  // in µs, which all of these can say
  for (const Case& c : cases) {
    const Recording before = open_recording(c.path);
    for (const std::string& stream : c.streams) {
      const auto restamped = [&](const std::string& from, const std::string& to, Duration by) {
        const std::filesystem::path out =
            folder.path() + "/" + stream + to + "/" + std::filesystem::path(c.path).filename().string();
        std::filesystem::create_directories(out.parent_path());
        const Restamped done = restamp_recording(from, out, moving(stream, by));
        EXPECT_EQ(done.streams.at(0).count, stamps_of(before, stream).size()) << c.path << ": " << stream;
        return out.string();
      };
      EXPECT_EQ(contents(restamped(c.path, "_same", Duration(0))), contents(c.path)) << c.path << ": " << stream;
      const std::string moved = restamped(c.path, "_moved", whole);
      const Recording after = open_recording(moved), back = open_recording(restamped(moved, "_back", -whole));
      for (const std::string& other : c.streams) {
        std::vector<Stamp> want = stamps_of(before, other);
        EXPECT_EQ(stamps_of(back, other), want) << c.path << ": " << stream;
        for (Stamp& t : want) t += other == stream ? whole : Duration(0);
        EXPECT_EQ(stamps_of(after, other), want) << c.path << ": " << stream << " moved, " << other;
      }
      if (before.cameras.empty()) continue;
      EXPECT_EQ(after.cameras.at(0).exposures_s, before.cameras[0].exposures_s) << c.path;
      EXPECT_EQ(after.cameras[0].open()->next()->image.row(1)[1], 'd') << c.path;
    }
  }
}

TEST(Restamp, WhatAFormatCannotSayIsRefused) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& in, const std::string& stream, Duration by) {
    return complaint([&] { std::ignore = restamp_recording(in, "", moving(stream, by)); });
  };
  const std::string odd = folder.file("odd.gcsv", "GYROFLOW IMU LOG\ntscale,0.0025\nt,gx,gy,gz\n4,1,1,1\n");
  EXPECT_NE(said(odd, "odd", shift).find("no power of ten"), std::string::npos);
  std::ignore = folder.file("kalibr/cam0/1000.pgm", "P5\n2 2\n255\nabcd");
  EXPECT_NE(said(folder.path() + "/kalibr", "cam0", -shift).find("below 0"), std::string::npos);
  EXPECT_NE(said(folder.path() + "/kalibr", "imu0", shift).find("it has: cam0"), std::string::npos);
  std::ignore = folder.file("kitti/image_00/timestamps.txt", "1970-01-01 00:00:01.0\n");
  EXPECT_NE(said(folder.path() + "/kitti", "image_00", -shift).find("does not have"), std::string::npos);
}

TEST(Restamp, AnAslFolderKeepsAllButTheStamps) {
  const TemporaryFolder folder;
  std::ignore = folder.file("in/mav0/cam0/data.csv", "#timestamp [ns],filename\n100,100.png\n200,200.png\n");
  std::ignore = folder.file("in/mav0/cam0/exposure.csv", "#timestamp [ns],exposure [ns]\n100,40\n200,60\n");
  std::ignore = folder.file("in/mav0/cam0/sensor.yaml", "stamp: start # of the exposure\nshutter: global\n");
  std::ignore = folder.file("in/mav0/cam0/data/100.png", "no picture");
  std::ignore = folder.file("in/mav0/imu0/data.csv", "#timestamp [ns],x\n1,0,0,0\n2,0,0,0\n");
  const std::string in = folder.path() + "/in", out = folder.path() + "/out";
  Restamping order = moving("cam0", Duration(-50));
  order.now_means = ExposureInstant::middle;
  const Restamped done = restamp_recording(in, out, order);
  EXPECT_EQ(done.streams.at(0).count, 2u);
  EXPECT_NE(done.notes.at(0).find("keep their file names"), std::string::npos);
  EXPECT_EQ(read_file(out + "/mav0/cam0/data.csv"), "#timestamp [ns],filename\n50,100.png\n150,200.png\n");
  EXPECT_EQ(read_file(out + "/mav0/cam0/exposure.csv"), "#timestamp [ns],exposure [ns]\n50,40\n150,60\n");
  EXPECT_EQ(read_file(out + "/mav0/cam0/sensor.yaml"), "stamp: middle # of the exposure\nshutter: global\n");
  EXPECT_EQ(read_file(out + "/mav0/cam0/data/100.png"), "no picture");
  EXPECT_EQ(read_file(out + "/mav0/imu0/data.csv"), read_file(in + "/mav0/imu0/data.csv"));
}

TEST(Restamp, RealBagsComeBackTheSame) {
  TAKT_NEEDS_REAL_DATA("ros1_bags");
  const TemporaryFolder folder;
  for (const char* name : {"ardrone_imu", "phidgets_imu_upside_down", "sparkfun_razor"}) {
    const std::string in = real_data(std::string("ros1_bags/") + name + ".bag"), out = folder.path() + "/" + name;
    static_cast<void>(restamp_recording(in, out, moving("/*imu*", Duration(0))));
    EXPECT_EQ(read_file(out), read_file(in)) << name;
    std::filesystem::remove(out);
    static_cast<void>(restamp_recording(in, out, moving("/*imu*", shift)));
    const Recording before = open_recording(in), after = open_recording(out);
    ASSERT_EQ(before.imus.at(0).size(), after.imus.at(0).size());
    EXPECT_EQ(after.imus[0].gyro_rad_s, before.imus[0].gyro_rad_s);
    EXPECT_EQ(after.imus[0].arrivals, before.imus[0].arrivals);
    for (std::size_t i = 0; i < after.imus[0].size(); ++i)
      ASSERT_EQ(after.imus[0].stamps[i], before.imus[0].stamps[i] + shift);
  }
}

}  // namespace
}  // namespace takt
