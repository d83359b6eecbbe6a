// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap_writer.h"
#include "takt/recording/message_writer.h"
#include "takt/recording/write_messages.h"

namespace takt {

namespace {

/// As ROS 2 records it.
class McapMessages : public MessageSink {
 public:
  explicit McapMessages(const std::string& path) : file_(path, "ros2") {}
  [[nodiscard]] MessageEncoding encoding() const override { return MessageEncoding::cdr; }
  void add_channel(const std::string& topic, const std::string& type) override {
    file_.add_channel(topic, {std::string(type).replace(type.find('/'), 1, "/msg/"), "ros2msg",
                              message_definition(MessageEncoding::cdr, type), "cdr"});
  }
  void write(std::uint32_t channel, Stamp recorded, std::span<const std::byte> message) override {
    file_.write(static_cast<std::uint16_t>(channel), static_cast<std::uint64_t>(to_ns(recorded)), message);
  }
  void finish() override { file_.finish(); }

 private:
  McapWriter file_;
};

}  // namespace

Written write_mcap(const Recording& recording, const std::string& out) {
  McapMessages sink(out);
  return write_messages(recording, sink);
}

}  // namespace takt
