// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap.h"
#include "takt/recording/mcap_container.h"
#include "takt/recording/write_messages.h"
#include "tests/fuzz.h"
#include "tests/mcap_writing.h"

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
  return takt::fuzz::written_as(".mcap", [&](const std::string& path) { (void)takt::write_mcap(r, path); });
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace takt::mcap_writing;
  const std::string channels = schema(1, "sensor_msgs/msg/Imu") + channel(1, 1, "/imu") +
                               schema(2, "sensor_msgs/msg/Image") + channel(2, 2, "/cam");
  const std::string data = message(1, 1, imu(1, 2, 3, 4)) + message(2, 1, image(1, 2, 2, 2, "abcd"));
  const std::string json = schema(1, "sensor_msgs/Imu", "jsonschema") + channel(1, 1, "/imu", "json") +
                           message(1, 1,
                                   R"({"header":{"stamp":{"sec":3,"nanosec":4}},"angular_velocity":)"
                                   R"({"x":1,"y":2,"z":3}})");
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {file(channels + data), file(chunk(channels + data)), file(chunk(channels + data, "lz4")),
       file(chunk(channels + data, "zstd")), file(json), indexed()});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view bytes) {
    const auto file = takt::view_bytes(std::as_bytes(std::span(bytes)));
    (void)takt::McapContainer(file, "run.mcap").recorded();
    const takt::Recording r = takt::read_mcap(file, "run.mcap");
    for (const takt::CameraStream& camera : r.cameras) {
      const auto frames = camera.open();
      for (int i = 0; i < 4 && frames->next(); ++i) {
      }
    }
  });
}
