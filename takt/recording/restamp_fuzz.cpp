// SPDX-License-Identifier: Apache-2.0
// Any bytes as a recording that is restamped: an error leaves the name that was asked for unused, and a copy reads as
// the input does, with other stamps.
#include <unistd.h>

#include <cstdlib>

#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/output_file.h"
#include "tests/db3_writing.h"
#include "tests/fuzz.h"
#include "tests/mcap_writing.h"
#include "tests/ros1_bag_writing.h"

namespace {

using namespace takt;
constexpr Duration shift(1'234'567);

std::string folder() {
  static const std::string path = [] {
    std::string name = (std::filesystem::temp_directory_path() / "takt-fuzz-XXXXXX").string();
    if (!mkdtemp(name.data())) std::abort();
    return name;
  }();
  return path;
}

/// An undamaged recording of IMUs and its copy have the same stamps, apart from the shift.
void compare(const std::string& in, const std::string& out) {
  const Recording before = open_recording(in);
  if (!before.notes.empty()) return;
  const Recording after = open_recording(out);
  if (after.imus.size() != before.imus.size()) std::abort();
  for (std::size_t i = 0; i < before.imus.size(); ++i) {
    std::vector<Stamp> moved = before.imus[i].stamps;
    for (Stamp& t : moved) t += shift;
    if (after.imus[i].stamps != moved) std::abort();
  }
}

std::string database() {
  const std::string path = folder() + "/seed.db3";
  {
    db3_writing::Database db(path);
    db.topic(1, "/imu", "sensor_msgs/msg/Imu");
    db.message(1, 7, mcap_writing::imu(17, 5, 0.1, 0.4));
  }
  return read_file(path);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  namespace mc = mcap_writing;
  namespace bag = bag_writing;
  const std::string channel = mc::schema(1, "sensor_msgs/msg/Imu") + mc::channel(1, 1, "/imu");
  const std::string messages = mc::message(1, 1, mc::imu(1, 2, 3, 4)) + mc::message(1, 2, mc::imu(5, 6, 7, 8));
  const std::string records =
      bag::connection(1, "/imu", "sensor_msgs/Imu") + bag::message(1, bag::header(1, 2) + std::string(296, '\1'));
  return fuzz::plant_seeds(
      *argc, *argv,
      {mc::file(channel + messages), "GYROFLOW IMU LOG\ntscale,0.001\nt,gx,gy,gz\n1.5,1,2,3\n2.5,1,2,3\n",
       mc::file(mc::chunk(channel + messages, "lz4")), mc::file(mc::chunk(channel + messages)),
       bag::bag(bag::chunk(records)), bag::bag(bag::chunk(records, "lz4")), database(),
       "t,wx,wy,wz\n0.1,1,2,3\n0.2,1,2,3\n0.3,1,2,3\n"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string in = folder() + "/in", part = folder() + "/.out.part", out = folder() + "/out";
  for (const std::string& path : {in, part, out}) std::filesystem::remove(path);
  std::ofstream(in, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    static_cast<void>(
        restamp_recording(in, part, {.stream = "*", .map = [](Stamp t) { return t + shift; }, .now_means = {}}));
    publish(part, out);
  } catch (const Error&) {
    if (std::filesystem::exists(out)) std::abort();
    return 0;
  }
  return fuzz::reads_or_says_why(data, size, [&](std::string_view) { compare(in, out); });
}
