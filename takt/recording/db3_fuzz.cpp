// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include "takt/recording/files.h"
#include "takt/recording/rosbag2.h"
#include "tests/db3_writing.h"
#include "tests/fuzz.h"
#include "tests/mcap_writing.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const std::string path = "/tmp/takt_db3_seed_" + std::to_string(::getpid());
  {
    takt::db3_writing::Database db(path, false);
    db.run("PRAGMA page_size=512");
    db.run("VACUUM");
    db.topic(1, "/imu", "sensor_msgs/msg/Imu");
    db.topic(2, "/cam", "sensor_msgs/msg/Image");
    db.message(1, 1, takt::mcap_writing::imu(1, 2, 3, 4));
    db.message(2, 1, takt::mcap_writing::image(1, 2, 20, 20, std::string(400, 'a')));
  }
  const std::string seed = takt::read_file(path);
  ::unlink(path.c_str());
  return takt::fuzz::plant_seeds(*argc, *argv, {seed});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view bytes) {
    const takt::Recording r = takt::read_db3(std::as_bytes(std::span(bytes)), "run.db3");
    for (const takt::CameraStream& camera : r.cameras) {
      const auto frames = camera.open();
      for (int i = 0; i < 4 && frames->next(); ++i) {
      }
    }
  });
}
