// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_bag.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/recording/open_recording.h"
#include "tests/ros1_bag_writing.h"
#include "tests/tools.h"

namespace takt {
namespace {

using namespace bag_writing;
using testing_tools::complaint;
using testing_tools::real_data;

Recording read(const std::string& bytes) {
  return read_ros1_bag(view_bytes(std::as_bytes(std::span(bytes))), "run.bag");
}
GrayImage only_picture(const Recording& r) {
  const auto frame = r.cameras.at(0).open()->next();
  return frame ? frame->image : GrayImage{};
}
std::string joined(const std::vector<std::string>& notes) {
  std::string all;
  for (const std::string& n : notes) all += n + "\n";
  return all;
}

TEST(Ros1Bag, GreyPicturesInEveryCompression) {
  for (const char* compression : {"none", "lz4", "bz2"}) {
    const std::string bytes =
        bag(chunk(connection(1, "/cam/image_raw", "sensor_msgs/Image") +
                      message(1, image(17, 2, 2, "mono8", 3, std::string("\x01\x02\x00\x03\x04\x00", 6))) +
                      message(1, image(18, 2, 2, "mono8", 2, std::string("\x05\x06\x07\x08", 4))),
                  compression));
    const Recording r = read(bytes);
    ASSERT_EQ(r.cameras.size(), 1u);
    EXPECT_EQ(r.cameras[0].name, "/cam/image_raw");
    EXPECT_EQ(to_ns(r.cameras[0].stamps.at(1)), 18'000'000'005);
    const auto reader = r.cameras[0].open();
    const auto first = reader->next(), second = reader->next();
    EXPECT_EQ(first->image.row(1)[1], 4);
    EXPECT_EQ(second->image.row(0)[1], 6);
    EXPECT_EQ(second->index, 1u);
    EXPECT_FALSE(reader->next());
  }
}

TEST(Ros1Bag, ColoursBecomeGrey) {
  const auto gray = [](const std::string& encoding, std::uint32_t stride, const std::string& pixels) {
    const std::string bytes =
        bag(chunk(connection(1, "/cam", "sensor_msgs/Image") + message(1, image(1, 1, 1, encoding, stride, pixels))));
    const Recording r = read(bytes);
    const GrayImage image = only_picture(r);
    return image.empty() ? -1 : image.row(0)[0];
  };
  EXPECT_EQ(gray("rgb8", 3, "\xff\xff\xff"), 255);
  EXPECT_EQ(gray("rgb8", 3, std::string("\xff\0\0", 3)), 76);
  EXPECT_EQ(gray("bgr8", 3, std::string("\0\0\xff", 3)), 76);
  EXPECT_EQ(gray("bgra8", 4, std::string("\0\xff\0\0", 4)), 150);
  EXPECT_EQ(gray("yuv422", 2, "\x10\x63"), 0x63);
  EXPECT_EQ(gray("mono16", 2, std::string("\x34\x00", 2)), 0x34);
  EXPECT_EQ(gray("mono16", 2, "\xff\x0f"), 255);  // 12 bits
  EXPECT_EQ(gray("mono16", 2, std::string("\x00\x80", 2)), 128);
  EXPECT_EQ(gray("bgr16", 6, std::string("\x00\x00\x00\x00\x00\xff", 6)), 76);
  EXPECT_EQ(gray("hologram", 1, "\x10"), -1);
  EXPECT_EQ(gray("mono8", 0, "\x10"), -1);
}

TEST(Ros1Bag, AMosaicOfOneColourIsFlat) {
  // Red 200, green 100, blue 40 everywhere: every pixel must come out as (200 + 2·100 + 40)/4.
  std::string pixels;
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 6; ++x) pixels += static_cast<char>((x + y) % 2 ? 100 : y % 2 ? 40 : 200);
  const std::string bytes =
      bag(chunk(connection(1, "/cam", "sensor_msgs/Image") + message(1, image(1, 6, 6, "bayer_rggb8", 6, pixels))));
  const Recording r = read(bytes);
  const GrayImage gray = only_picture(r);
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 6; ++x) EXPECT_EQ(gray.row(y)[x], 110) << x << ' ' << y;
}

Recording with_camera_info(double k3) {
  std::string info =
      header(1, 0) + raw(std::uint32_t{480}) + raw(std::uint32_t{640}) + sized("plumb_bob") + raw(std::uint32_t{5});
  for (const double d : {-0.3, 0.1, 0.001, 0.002, k3}) info += raw(d);
  for (const double k : {400.0, 0.0, 320.0, 0.0, 401.0, 240.0, 0.0, 0.0, 1.0}) info += raw(k);
  return read(bag(chunk(connection(1, "/a/image_raw", "sensor_msgs/Image") +
                        connection(2, "/a/camera_info", "sensor_msgs/CameraInfo") +
                        message(1, image(1, 1, 1, "mono8", 1, "x")) + message(2, info))));
}

TEST(Ros1Bag, CameraInfoGivesTheModelOfItsNameSpace) {
  const Recording r = with_camera_info(0);
  ASSERT_TRUE(r.cameras[0].model);
  EXPECT_EQ(r.cameras[0].model->fy, 401);
  EXPECT_EQ(r.cameras[0].model->distortion, Distortion::radtan);
  EXPECT_EQ(r.cameras[0].timing.rows, 480);
}

TEST(Ros1Bag, AThirdRadialTermIsPutIntoTheFirstTwoAndSaid) {
  const double k3 = -0.02;
  const Recording r = with_camera_info(k3);
  ASSERT_TRUE(r.cameras.at(0).model) << joined(r.notes);
  EXPECT_NE(joined(r.notes).find("k3 of its camera_info was put into k1 and k2 (at most"), std::string::npos);
  const auto& c = r.cameras[0].model->coeffs;
  for (const double radius : {0.2, 0.4, 0.6, 0.8, 1.0}) {
    const double r2 = radius * radius;
    const double theirs = radius * (1 + r2 * (-0.3 + r2 * (0.1 + r2 * k3))),
                 ours = radius * (1 + r2 * (c[0] + r2 * c[1]));
    EXPECT_NEAR(400 * ours, 400 * theirs, 0.5) << radius;
  }
}

TEST(Ros1Bag, ZeroFilledTailIsPassedOver) {
  const std::string bytes =
      bag(chunk(connection(1, "/cam", "sensor_msgs/Image") + message(1, image(1, 1, 1, "mono8", 1, "x")))) +
      std::string(100'003, '\0');
  const Recording r = read(bytes);
  EXPECT_EQ(r.cameras.at(0).size(), 1u);
  EXPECT_NE(joined(r.notes).find("100003 zero bytes"), std::string::npos) << joined(r.notes);
}

TEST(Ros1Bag, HugeClaimsCostNothing) {
  const std::string claims =
      record({"op=\x05", "compression=bz2", "size=" + raw(std::uint32_t{1} << 29)}, "no bzip2 here");
  EXPECT_NE(complaint([&] { (void)read(bag(claims)); }).find("1 chunks or records are broken"), std::string::npos);
  const std::string long_header = bag(raw(std::uint32_t{0xfffffff0}));
  EXPECT_NE(complaint([&] { (void)read(long_header); }).find("broken"), std::string::npos);
}

TEST(Ros1Bag, OtherFilesAreRefused) {
  EXPECT_NE(complaint([] { (void)read(""); }).find("is no ROS 1 bag"), std::string::npos);
  EXPECT_NE(complaint([] { (void)read("#ROSBAG V1.2\nsomething"); }).find("another version"), std::string::npos);
  EXPECT_NE(complaint([] { (void)read(bag("")); }).find("has no messages"), std::string::npos);
}

struct RealBag {
  const char* file;
  const char* topic;
  std::size_t messages;  // as the bag's own index records count them
};
const RealBag real_bags[] = {{"ardrone_imu.bag", "/ardrone/imu", 4308},
                             {"phidgets_imu_upside_down.bag", "/imu/data_raw", 13964},
                             {"sparkfun_razor.bag", "/imu/data_raw", 2144}};

TEST(Ros1Bag, RealBagsHaveTheCountsOfTheirIndex) {
  TAKT_NEEDS_REAL_DATA("ros1_bags");
  for (const RealBag& b : real_bags) {
    const Recording r = open_recording(real_data(std::string("ros1_bags/") + b.file));
    EXPECT_EQ(r.format, "ROS 1 bag");
    ASSERT_EQ(r.imus.size(), 1u) << b.file;
    EXPECT_EQ(r.imus[0].name, b.topic);
    EXPECT_EQ(r.imus[0].size(), b.messages);
    EXPECT_EQ(r.imus[0].accel_m_s2.size(), b.messages);
    EXPECT_TRUE(r.notes.empty()) << joined(r.notes);
  }
}

TEST(Ros1Bag, RealBagsWithoutSensorsSayWhatTheyHold) {
  TAKT_NEEDS_REAL_DATA("ros1_bags");
  for (const char* name : {"example.bag", "example-bz2.bag", "example-lz4.bag"}) {
    const std::string said = complaint([&] { (void)open_recording(real_data(std::string("ros1_bags/") + name)); });
    EXPECT_NE(said.find("neither IMU nor camera messages, only"), std::string::npos) << said;
    EXPECT_NE(said.find("turtlesim/Pose"), std::string::npos) << said;
  }
}

TEST(Ros1Bag, RealBagsCutAnywhereGiveWhatWasBeforeOrSayWhy) {
  TAKT_NEEDS_REAL_DATA("ros1_bags");
  for (const RealBag& b : real_bags) {
    const std::string whole = read_file(real_data(std::string("ros1_bags/") + b.file));
    const std::size_t pieces = whole.size() < 200'000 ? 40 : 5;
    std::size_t most = 0;
    for (std::size_t i = 0; i < pieces; ++i) {
      const std::string part = whole.substr(0, whole.size() * i / pieces);
      const std::string said = complaint([&] {
        const Recording r = read(part);
        EXPECT_GE(r.imus.at(0).size(), most);  // a longer piece holds no less
        most = r.imus.at(0).size();
        EXPECT_TRUE(most < b.messages || !r.notes.empty());
      });
      EXPECT_TRUE(!said.empty() || most > 0) << b.file << " cut at " << part.size();
    }
    EXPECT_LE(most, b.messages);
    EXPECT_GT(most, b.messages / 4);
  }
}

}  // namespace
}  // namespace takt
