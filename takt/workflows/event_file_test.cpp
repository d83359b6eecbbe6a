// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/event_file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "takt/recording/mcap_container.h"
#include "takt/recording/mcap_records.h"
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
  const auto bytes = open_bytes(path);
  McapContainer file(bytes, path);
  EXPECT_EQ(file.channels().size(), 2U);
  const auto summary = mcap::read_summary(*bytes);
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->channels.all().at(1).topic, "/takt/pps");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

}  // namespace
}  // namespace takt
