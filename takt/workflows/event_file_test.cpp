// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/event_file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "takt/recording/mcap_container.h"
#include "tests/tools.h"

namespace takt {
namespace {

TEST(EventFile, WhatIsWrittenIsRead) {
  const testing_tools::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.mcap";
  {
    EventFile events(path);
    events.write("/takt/pps", 1'700'000'000'000'000'000, R"({"ticks":1})");
    events.write("/takt/imu0", 1'700'000'000'100'000'000, R"({"ticks":2})");
    events.write("/takt/pps", 1'700'000'001'000'000'000, R"({"ticks":3})");
    EXPECT_FALSE(std::filesystem::exists(path)) << "no half-written file under its name";
    events.finish();
  }
  const McapContainer file(open_bytes(path), path);
  const std::vector<Channel> channels = file.channels();
  ASSERT_EQ(channels.size(), 2U);
  EXPECT_EQ(channels[0].topic, "/takt/pps");
  int seen = 0;
  const auto notes = file.visit([](const Channel&) { return whole_message; }, [&](const Message&) { ++seen; });
  EXPECT_EQ(seen, 3);
  EXPECT_TRUE(notes.empty()) << notes.front();
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

}  // namespace
}  // namespace takt
