// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_bag.h"
#include "takt/recording/ros1_container.h"
#include "takt/recording/write_messages.h"
#include "tests/fuzz.h"
#include "tests/ros1_bag_writing.h"

namespace {

/// With an index, as takt writes it.
std::string indexed() {
  takt::Recording r;
  r.imus.emplace_back();
  r.imus[0].name = "imu0";
  for (int i = 0; i < 3; ++i) {
    r.imus[0].stamps.push_back(takt::from_ns(1'000'000 * i));
    r.imus[0].gyro_rad_s.emplace_back(1, 2, 3);
  }
  return takt::fuzz::written_as(".bag", [&](const std::string& path) { (void)takt::write_ros1_bag(r, path); });
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace takt::bag_writing;
  const std::string pictures = connection(1, "/cam/image_raw", "sensor_msgs/Image") +
                               message(1, image(17, 2, 2, "mono8", 2, "abcd")) +
                               message(1, image(18, 2, 2, "bayer_rggb8", 2, "efgh"));
  const std::string imu = connection(2, "/imu", "sensor_msgs/Imu") + message(2, header(1, 2) + std::string(296, '\0'));
  return takt::fuzz::plant_seeds(*argc, *argv,
                                 {bag(chunk(pictures)), bag(chunk(imu)), bag(chunk(pictures, "lz4")),
                                  bag(chunk(imu, "bz2")), bag(chunk(imu) + std::string(100, '\0')), indexed()});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view bytes) {
    const auto file = takt::view_bytes(std::as_bytes(std::span(bytes)));
    (void)takt::Ros1Container(file, "run.bag").recorded();
    const takt::Recording r = takt::read_ros1_bag(file, "run.bag");
    for (const takt::CameraStream& camera : r.cameras) {
      const auto frames = camera.open();
      for (int i = 0; i < 4 && frames->next(); ++i) {
      }
    }
  });
}
