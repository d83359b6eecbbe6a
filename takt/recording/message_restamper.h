// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "takt/recording/message_file.h"
#include "takt/recording/record_walk.h"
#include "takt/recording/restamp.h"

namespace takt {

/// A message whose stamp has been exchanged: in place, or in `longer` where its length changes (JSON).
struct RestampedMessage {
  Stamp before, after;
  std::optional<std::vector<std::byte>> longer;

  [[nodiscard]] Duration moved_by() const { return after - before; }
};

/// What the writers of all containers of messages share: which topics move, and what has happened to them.
class MessageRestamper {
 public:
  /// A camera's camera_info goes with its pictures, or the two would not match any more. Throws takt::Error at `where`
  /// where no channel has the name, or one whose messages have no header to restamp.
  MessageRestamper(const std::vector<Channel>& channels, const Restamping& order, std::string where);

  [[nodiscard]] bool moves(const Channel& channel) const { return topics_.contains(channel.topic); }
  [[nodiscard]] bool moves_record_time() const { return order_.record_time; }
  /// Nothing where the message stays as it is: its stamp does not move, or it is broken, which is counted. Throws
  /// takt::Error where the new stamp does not fit into it.
  [[nodiscard]] std::optional<RestampedMessage> restamp(const Channel& channel, std::span<std::byte> message);

  void count_broken() { ++broken_; }
  [[nodiscard]] std::size_t broken() const { return broken_; }
  void left_out(const RecordWalk::Damage& damage);
  void note(std::string words) { result_.notes.push_back(std::move(words)); }
  [[nodiscard]] Restamped finish();

 private:
  const Restamping& order_;
  std::string where_;
  std::set<std::string> topics_;
  RestampLog log_;
  std::size_t broken_ = 0;
  Restamped result_;
};

}  // namespace takt
