// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/files.h"

/// The container of ROS 1 bags, format 2.0: records, and chunks of records (none, bz2, lz4).
/// http://wiki.ros.org/Bags/Format/2.0
namespace takt {

[[nodiscard]] bool is_ros1_bag(std::string_view head);

struct Ros1Connection {
  std::string topic;
  std::string type;  ///< "sensor_msgs/Imu"
};

/// Where a message's bytes are: in a chunk's records, or in the file itself where `chunk` is empty.
struct Ros1Place {
  std::optional<std::uint64_t> chunk;  ///< byte of the chunk's record in the file
  std::uint64_t offset = 0;
  std::uint32_t size = 0;
};

struct Ros1Message {
  const Ros1Connection& connection;
  Ros1Place place;
  std::span<const std::byte> data;  ///< only during the visit
};

class Ros1Container {
 public:
  /// Throws takt::Error where this is no bag of version 2.0.
  Ros1Container(std::shared_ptr<const ByteSource> bytes, std::string where);

  /// Every message in the file's order, one chunk in memory at a time. Needs no index. Returns in words what was broken
  /// or missing, e.g. that the file is cut off; what could be read has been visited.
  [[nodiscard]] std::vector<std::string> visit(const std::function<void(const Ros1Message&)>& see) const;

  /// The records of the chunk at `offset`, decompressed; nothing where it is broken.
  [[nodiscard]] std::shared_ptr<const std::vector<std::byte>> chunk(std::uint64_t offset) const;
  [[nodiscard]] const ByteSource& bytes() const { return *bytes_; }

 private:
  std::shared_ptr<const ByteSource> bytes_;
  std::string where_;
};

}  // namespace takt
