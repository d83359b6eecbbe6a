// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/files.h"
#include "takt/recording/message_file.h"

namespace takt {

[[nodiscard]] bool is_mcap(std::string_view head);

/// Reads with or without summary. A summary lets chunks without wanted messages pass unread. Checksums of chunks that
/// are decompressed are held against their content. Of a file that is cut off, what stands before the cut is read.
class McapContainer : public MessageFile {
 public:
  /// Throws takt::Error where this is no MCAP file.
  McapContainer(std::shared_ptr<const ByteSource> bytes, const std::string& where);

  [[nodiscard]] std::vector<std::string> visit(const Wants& wants,
                                               const std::function<void(const Message&)>& see) const override;
  [[nodiscard]] std::vector<Channel> channels() const override;
  [[nodiscard]] std::shared_ptr<const Bytes> chunk(std::uint64_t place) const override;
  [[nodiscard]] std::shared_ptr<const Bytes> message(const MessagePlace& place) const override;

 private:
  std::shared_ptr<const ByteSource> bytes_;
};

}  // namespace takt
