// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/recorded_times.h"

#include <memory>

#include "takt/error.h"
#include "takt/recording/db3_container.h"
#include "takt/recording/mcap.h"
#include "takt/recording/mcap_container.h"
#include "takt/recording/ros1_bag.h"
#include "takt/recording/ros1_container.h"
#include "takt/recording/rosbag2.h"

namespace takt {

namespace {

std::unique_ptr<MessageFile> container_of(const std::string& path) {
  if (looks_like_ros1_bag(path)) return std::make_unique<Ros1Container>(open_bytes(path), path);
  if (looks_like_mcap(path)) return std::make_unique<McapContainer>(open_bytes(path), path);
  if (looks_like_db3(path)) return std::make_unique<Db3Container>(path);
  throw Error("has no index: this is no bag, no MCAP file and no rosbag2 database", path, "inspect it without --index");
}

}  // namespace

std::vector<RecordedTimes> recorded_times(const std::string& path) {
  auto all = container_of(path)->recorded();
  if (!all) throw Error("has no index, or one that is not whole", path, "inspect it without --index");
  return std::move(*all);
}

}  // namespace takt
