// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "takt/recording/message_file.h"
#include "takt/streams/streams.h"

namespace takt {

struct WrittenStream {
  std::string name;     ///< as it was read
  std::string written;  ///< its name now
  std::size_t count = 0;
};
struct Written {
  std::vector<WrittenStream> streams;
  std::vector<std::string> notes;  ///< what the new format has no place for
};

/// Where messages go: a writer of one container.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  [[nodiscard]] virtual MessageEncoding encoding() const = 0;
  /// Channels are numbered from 1, in the order in which they are added, all before the first message.
  virtual void add_channel(const std::string& topic, const std::string& type) = 0;
  virtual void write(std::uint32_t channel, Stamp recorded, std::span<const std::byte> message) = 0;
  virtual void finish() = 0;
};

/// The recording's IMUs and cameras as sensor_msgs, in the order in which they were recorded (or sampled, where that is
/// not known); pictures as they are stored, where they are JPEG, PNG or messages, else in grey. One picture a camera is
/// in memory at a time.
[[nodiscard]] Written write_messages(const Recording& recording, MessageSink& sink);

/// New files; `out` is not there yet. Throw takt::Error.
[[nodiscard]] Written write_mcap(const Recording& recording, const std::string& out);
[[nodiscard]] Written write_ros1_bag(const Recording& recording, const std::string& out);
[[nodiscard]] Written write_db3(const Recording& recording, const std::string& out);

}  // namespace takt
