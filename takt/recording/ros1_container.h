// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/files.h"
#include "takt/recording/message_file.h"

/// The container of ROS 1 bags, format 2.0: records, and chunks of records (none, bz2, lz4).
namespace takt {

[[nodiscard]] bool is_ros1_bag(std::string_view head);

/// Reads with or without index. An index lets chunks without wanted messages pass unread; without one every chunk is
/// looked into. Of a file that is cut off, what stands before the cut is read, that of its last chunk too.
class Ros1Container : public MessageFile {
 public:
  /// Throws takt::Error where this is no bag of version 2.0.
  Ros1Container(std::shared_ptr<const ByteSource> bytes, const std::string& where);

  [[nodiscard]] std::vector<std::string> visit(const Wants& wants,
                                               const std::function<void(const Message&)>& see) const override;
  [[nodiscard]] std::vector<Channel> channels() const override;
  [[nodiscard]] std::shared_ptr<const Bytes> chunk(std::uint64_t place) const override;
  [[nodiscard]] std::shared_ptr<const Bytes> message(const MessagePlace& place) const override;

 private:
  std::shared_ptr<const ByteSource> bytes_;
};

}  // namespace takt
