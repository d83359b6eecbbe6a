// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_bag.h"

#include "takt/recording/message_streams.h"
#include "takt/recording/ros1_container.h"

namespace takt {

bool looks_like_ros1_bag(const std::string& path) {
  const std::string head = file_head(path, 16);
  return is_ros1_bag(head) || (path.ends_with(".bag") && !head.empty());
}

Recording read_ros1_bag(const std::string& path, const OpenOptions&) {
  return read_ros1_bag(open_bytes(path), path);
}

Recording read_ros1_bag(std::shared_ptr<const ByteSource> bytes, const std::string& path) {
  return message_streams(std::make_shared<const Ros1Container>(std::move(bytes), path), path,
                         "copy the bag again, or try `rosbag reindex`");
}

}  // namespace takt
