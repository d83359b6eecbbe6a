// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/inspect.h"

#include <gtest/gtest.h>

#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::real_data;
using testing_tools::TemporaryFolder;

TEST(Inspect, SaysWhatALogHolds) {
  const TemporaryFolder folder;
  const std::string path = folder.file("gyro.csv",
                                       "t_ns,wx,wy,wz\n0,0,0,1\n10000000,0,0,1\n10000000,0,0,1\n20000000,0,0,1\n"
                                       "60000000,0,0,1\n50000000,0,0,1\n");
  const Inspection found = inspect(path);
  ASSERT_EQ(found.streams.size(), 1u);
  EXPECT_EQ(found.streams[0].name, "gyro");
  EXPECT_EQ(found.streams[0].kind, "imu");
  EXPECT_EQ(found.streams[0].stamps.duplicates, 1u);
  EXPECT_EQ(found.streams[0].stamps.backward_steps, 1u);
  EXPECT_EQ(found.streams[0].stamps.gaps.size(), 1u);
  EXPECT_FALSE(found.notes.empty());
}

TEST(Inspect, CutsAndUnitsReachTheReader) {
  const TemporaryFolder folder;
  const std::string path = folder.file("gyro.csv", "0,0,0,1\n10,0,0,1\n20,0,0,1\n30,0,0,1\n");
  const Inspection found = inspect(path, {.time_unit = TimeUnit::s, .from_s = 10.0, .to_s = 20.0});
  EXPECT_EQ(found.streams.at(0).stamps.count, 2u);
  EXPECT_DOUBLE_EQ(found.streams[0].stamps.span_s, 10);
}

TEST(Inspect, AMissingPathIsAnError) {
  EXPECT_NE(complaint([] { (void)inspect("/no/such/recording"); }).find("no such file"), std::string::npos);
}

TEST(Inspect, RealEuroc) {
  TAKT_NEEDS_REAL_DATA("euroc_micro");
  const Inspection found = inspect(real_data("euroc_micro"));
  ASSERT_EQ(found.streams.size(), 3u);
  EXPECT_NEAR(*found.streams[0].stamps.rate_hz, 200, 0.01);
  EXPECT_EQ(found.streams[1].stamps.count, 95u);
  EXPECT_EQ(found.streams[0].stamps.resolution, Duration(256));
}

}  // namespace
}  // namespace takt
