// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/time/instant.h"

/// What ROS 1 bags, MCAP files and rosbag2 databases have in common: messages on channels, many of them in compressed
/// chunks.
namespace takt {

/// How a message's fields stand in its bytes.
enum class MessageEncoding { ros1, cdr, json, other };

struct Channel {
  std::string topic;
  std::string type;  ///< "sensor_msgs/Imu": ROS 2's "/msg/" is left out
  MessageEncoding encoding = MessageEncoding::other;
  std::string definition;  ///< of the type, in ROS' language; empty where the file does not say
};

/// "sensor_msgs/msg/Imu" -> "sensor_msgs/Imu"
[[nodiscard]] std::string plain_type(std::string type);

/// Where a message's bytes are: in a chunk's records, or in the file itself where `chunk` is empty.
struct MessagePlace {
  std::optional<std::uint64_t> chunk;
  std::uint64_t offset = 0;
  std::uint32_t size = 0;
};

struct Message {
  const Channel& channel;
  MessagePlace place;
  Stamp recorded;                   ///< the recorder's time, on its own clock
  std::span<const std::byte> head;  ///< as many of its first bytes as were wanted; only during the visit
};

/// When a channel's messages were recorded, by the recorder's clock.
struct RecordedTimes {
  Channel channel;
  std::vector<Stamp> times;
};

/// How many of its first bytes a channel's messages are wanted with; 0: they are passed over, unread where possible.
using Wants = std::function<std::uint64_t(const Channel&)>;
constexpr std::uint64_t whole_message = UINT64_MAX;

class MessageFile {
 public:
  using Bytes = std::vector<std::byte>;
  virtual ~MessageFile() = default;

  /// Every wanted message in the file's order, with bounded memory. Returns in words what was broken or missing, e.g.
  /// that the file is cut off; what could be read has been visited.
  [[nodiscard]] virtual std::vector<std::string> visit(const Wants& wants,
                                                       const std::function<void(const Message&)>& see) const = 0;
  /// Every channel that the file has, from its index where it has one.
  [[nodiscard]] virtual std::vector<Channel> channels() const = 0;
  /// From indexes alone, no message is read. Nothing where the file has none, or one that does not tell all.
  [[nodiscard]] virtual std::optional<std::vector<RecordedTimes>> recorded() const = 0;
  /// The records of the chunk at that place, decompressed; nothing where it is broken.
  [[nodiscard]] virtual std::shared_ptr<const Bytes> chunk(std::uint64_t place) const = 0;
  /// The bytes of a message that is in no chunk; nothing where they cannot be read.
  [[nodiscard]] virtual std::shared_ptr<const Bytes> message(const MessagePlace& place) const = 0;
};

}  // namespace takt
