// SPDX-License-Identifier: Apache-2.0
// takt convert as it is typed: statuses, what is written, and what is left of a failure.
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/command_for_tests.h"
#include "takt/recording/open_recording.h"
#include "takt/workflows/convert.h"
#include "tests/ros1_bag_writing.h"
#include "tests/tools.h"

namespace takt::cli {
namespace {

using namespace bag_writing;
using testing_tools::TemporaryFolder;

std::string a_bag() {
  std::string records = connection(1, "/cam/image_raw", "sensor_msgs/Image") + connection(2, "/imu", "sensor_msgs/Imu");
  for (std::uint32_t i = 0; i < 20; ++i) {
    records += message(1, image(100 + i, 4, 2, "mono8", 4, std::string(8, static_cast<char>(i))));
    for (std::uint32_t k = 0; k < 5; ++k)
      records += message(2, header(100 + i, k * 200'000'000) + std::string(296, '\0'));
  }
  return bag(chunk(records));
}

TEST(Convert, EveryFormatHoldsTheSameStreams) {
  const TemporaryFolder folder;
  const std::string in = folder.file("in.bag", a_bag()), log = folder.path() + "/log";
  const Recording before = open_recording(in);
  for (const char* name : {"out.mcap", "out.bag", "out.db3", "out", "out.csv"}) {
    const std::string out = folder.path() + "/" + name;
    ASSERT_EQ(finish(start({"convert", in, "-o", out, "--json"}, log)), 0) << content(log);
    EXPECT_NE(content(log).find("\"count\": 100"), std::string::npos) << content(log);
    const Recording after = open_recording(out);
    ASSERT_EQ(after.imus.size(), 1u) << name;
    EXPECT_EQ(after.imus[0].stamps, before.imus[0].stamps) << name;
    EXPECT_EQ(after.imus[0].gyro_rad_s, before.imus[0].gyro_rad_s) << name;
    if (std::string(name) == "out.csv") continue;
    ASSERT_EQ(after.cameras.size(), 1u) << name;
    EXPECT_EQ(after.cameras[0].stamps, before.cameras[0].stamps) << name;
    const auto frames = after.cameras[0].open();
    EXPECT_EQ(frames->next()->image.row(1)[3], 0) << name;
    EXPECT_EQ(frames->next()->image.row(1)[3], 1) << name;
  }
}

TEST(Convert, FailuresLeaveNothing) {
  const TemporaryFolder folder;
  const std::string in = folder.file("in.bag", a_bag()), log = folder.path() + "/log";
  const auto takt = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all{"convert", in};
    all.insert(all.end(), more.begin(), more.end());
    return finish(start(all, log));
  };
  EXPECT_EQ(takt({}), 2);
  EXPECT_EQ(takt({"-o", folder.path() + "/out.txt"}), 1);
  EXPECT_EQ(takt({"-o", in}), 1);
  EXPECT_EQ(takt({"-o", folder.path() + "/out.bag", "--sensor", "nobody"}), 1);
  EXPECT_EQ(takt({"-o", folder.path() + "/no/out.bag"}), 1);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"in.bag", "log"}));
  EXPECT_EQ(takt({"-o", folder.path() + "/out.csv", "--sensor", "/imu", "-q"}), 0) << content(log);
}

}  // namespace
}  // namespace takt::cli
