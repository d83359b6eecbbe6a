// SPDX-License-Identifier: Apache-2.0
// A recording written as a bag, an MCAP file or a rosbag2 database is the same recording, bit by bit.
#include "takt/recording/write_messages.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/recorded_times.h"
#include "takt/recording/stored_picture.h"
#include "tests/ros1_bag_writing.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::TemporaryFolder;

constexpr int width = 300, height = 200;

/// Pictures whose first pixel is their number. The third is broken.
class Pictures : public FrameReader {
 public:
  explicit Pictures(std::vector<Stamp> stamps) : stamps_(std::move(stamps)) {}
  std::optional<Frame> next() override {
    if (i_ == 2) ++i_, ++broken_;
    if (i_ >= stamps_.size()) return std::nullopt;
    const auto pixels = std::make_shared<std::vector<std::uint8_t>>((width + 4) * height, 77);
    pixels->front() = static_cast<std::uint8_t>(i_);
    Frame out{i_, stamps_[i_], 0, {width, height, width + 4, pixels->data(), pixels}};
    ++i_;
    return out;
  }

 private:
  std::vector<Stamp> stamps_;
  std::size_t i_ = 0;
};

Recording camera_and_imus() {
  Recording r;
  ImuStream imu;
  imu.name = "imu0";
  for (int i = 0; i < 500; ++i) {
    imu.stamps.push_back(from_ns(1'700'000'000'123'456'789 + 5'000'001LL * i));
    imu.gyro_rad_s.emplace_back(0.1 * i, -1.0 / 3, std::numeric_limits<double>::denorm_min());
    imu.accel_m_s2.emplace_back(1e-17 * i, 2, 9.81);
  }
  r.imus.push_back(imu);
  imu.name = "/gyro";
  imu.accel_m_s2.clear();
  r.imus.push_back(imu);
  CameraStream camera;
  camera.name = "/left/image_raw/compressed";
  for (int i = 0; i < 50; ++i) {
    camera.stamps.push_back(from_ns(1'700'000'000'200'000'000 + 50'000'000LL * i));
    camera.arrivals.push_back(camera.stamps.back() + Duration(7'654'321));
  }
  camera.model.emplace();
  camera.model->width = width, camera.model->height = height;
  camera.model->fx = 201.5, camera.model->fy = 200.25, camera.model->cx = 150.125, camera.model->cy = 99;
  camera.model->distortion = Distortion::radtan;
  camera.model->coeffs = {-0.3, 0.1, 1e-4, -2e-4};
  camera.open = [stamps = camera.stamps] { return std::make_unique<Pictures>(stamps); };
  r.cameras.push_back(camera);
  return r;
}

TEST(WriteMessages, TheSameRecordingInEveryContainer) {
  const TemporaryFolder folder;
  const Recording before = camera_and_imus();
  const std::array<std::string, 3> files{folder.path() + "/run.mcap", folder.path() + "/run.bag",
                                         folder.path() + "/run.db3"};
  std::ignore = write_mcap(before, files[0]);
  const Written written = write_ros1_bag(before, files[1]);
  std::ignore = write_db3(before, files[2]);
  ASSERT_EQ(written.streams.size(), 3u);
  EXPECT_EQ(written.streams[2].written, "/left/image_raw");
  EXPECT_EQ(written.streams[2].count, 49u);
  EXPECT_NE(written.notes.at(0).find("1 pictures could not be decoded"), std::string::npos);

  for (const std::string& file : files) {
    const Recording after = open_recording(file);
    ASSERT_EQ(after.imus.size(), 2u) << file;
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      const ImuStream& imu = after.imus[after.imus[i].name == "/imu0" ? 0 : 1];
      EXPECT_EQ(imu.stamps, before.imus[0].stamps) << file;
      EXPECT_EQ(imu.arrivals, before.imus[0].stamps) << file;
      EXPECT_EQ(imu.gyro_rad_s, before.imus[0].gyro_rad_s) << file;
    }
    const auto named = [&](const std::string& name) {
      return after.imus[0].name == name ? after.imus[0] : after.imus[1];
    };
    EXPECT_EQ(named("/imu0").accel_m_s2, before.imus[0].accel_m_s2) << file;
    EXPECT_TRUE(named("/gyro").accel_m_s2.empty()) << file;

    ASSERT_EQ(after.cameras.size(), 1u) << file;
    const CameraStream& camera = after.cameras[0];
    EXPECT_EQ(camera.name, "/left/image_raw");
    ASSERT_EQ(camera.size(), 49u);
    EXPECT_EQ(camera.stamps[2], before.cameras[0].stamps[3]) << file;
    EXPECT_EQ(camera.arrivals[2], before.cameras[0].arrivals[3]) << file;
    ASSERT_TRUE(camera.model) << file;
    EXPECT_EQ(camera.model->coeffs, before.cameras[0].model->coeffs);
    EXPECT_EQ(camera.model->cx, 150.125);
    const auto frames = camera.open();
    for (std::size_t i = 0; i < 49; ++i) {
      const auto frame = frames->next();
      ASSERT_TRUE(frame) << file;
      EXPECT_EQ(frame->image.row(0)[0], i < 2 ? i : i + 1) << file;
      EXPECT_EQ(frame->image.row(height - 1)[width - 1], 77) << file;
    }
    for (const std::string& note : after.notes) EXPECT_NE(note.find("which instant"), std::string::npos) << note;

    const auto recorded = recorded_times(file);  // by the index
    ASSERT_EQ(recorded.size(), 4u) << file;
    for (const RecordedTimes& topic : recorded) {
      const bool of_imu = topic.channel.type == "sensor_msgs/Imu";
      EXPECT_EQ(topic.times, of_imu ? after.imus[0].arrivals : camera.arrivals) << file << ": " << topic.channel.topic;
    }
    const std::string bytes = read_file(file);
    const std::string cut = folder.file("cut" + file.substr(file.rfind('.')), bytes.substr(0, bytes.size() - 100));
    if (!file.ends_with(".db3")) {
      EXPECT_NE(complaint([&] { std::ignore = recorded_times(cut); }).find("has no index"), std::string::npos) << file;
    }
  }
}

TEST(WriteMessages, ColoursAndCompressedPicturesStayAsTheyAre) {
  namespace w = bag_writing;
  const TemporaryFolder folder;
  std::vector<std::uint8_t> png;
  cv::imencode(".png", cv::Mat3b(2, 3, cv::Vec3b(10, 20, 200)), png);
  const std::string encoded(png.begin(), png.end()), colours = "bgrBGRbgrBGR";
  const Recording before = open_recording(
      folder.file("in.bag", w::bag(w::connection(1, "/a/image_raw", "sensor_msgs/Image") +
                                   w::connection(2, "/b/image_raw/compressed", "sensor_msgs/CompressedImage") +
                                   w::message(1, w::image(17, 2, 2, "bgr8", 6, colours)) +
                                   w::message(2, w::header(17, 5) + w::sized("png") + w::sized(encoded)))));
  const std::array<std::string, 3> files{folder.path() + "/run.mcap", folder.path() + "/run.bag",
                                         folder.path() + "/run.db3"};
  std::ignore = write_mcap(before, files[0]);
  std::ignore = write_ros1_bag(before, files[1]);
  const Written written = write_db3(before, files[2]);
  for (const std::string& note : written.notes) EXPECT_EQ(note.find("in grey"), std::string::npos) << note;
  const auto text = [](std::span<const std::byte> bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  for (const std::string& file : files) {
    const Recording after = open_recording(file);
    ASSERT_EQ(after.cameras.size(), 2u) << file;
    for (const CameraStream& camera : after.cameras) {
      const auto frames = camera.open();
      ASSERT_TRUE(frames->next()) << file;
      const auto stored = stored_picture(*frames);
      ASSERT_TRUE(stored) << file;
      if (camera.name == "/a/image_raw") {
        EXPECT_EQ(std::get<RawPicture>(*stored).encoding, "bgr8");
        EXPECT_EQ(text(std::get<RawPicture>(*stored).pixels), colours) << file;
      } else {
        EXPECT_EQ(camera.name, "/b/image_raw/compressed");
        EXPECT_EQ(std::get<EncodedPicture>(*stored).format, "png");
        EXPECT_EQ(text(std::get<EncodedPicture>(*stored).bytes), encoded) << file;
      }
    }
  }
}

TEST(WriteMessages, WhatABagCannotHoldIsRefused) {
  const TemporaryFolder folder;
  Recording r = camera_and_imus();
  r.imus[0].stamps[3] = from_ns(-5);
  EXPECT_NE(complaint([&] { std::ignore = write_ros1_bag(r, folder.path() + "/run.bag"); }).find("-5 ns, does not fit"),
            std::string::npos);
  std::ignore = write_mcap(r, folder.path() + "/run.mcap");
  EXPECT_EQ(to_ns(open_recording(folder.path() + "/run.mcap").imus.at(0).stamps.at(3)), -5);
}

}  // namespace
}  // namespace takt
