// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "takt/recording/files.h"
#include "takt/recording/message_file.h"
#include "takt/recording/record_format.h"

namespace takt {

/// A file of records and chunks. Reads with or without index. An index lets chunks without wanted messages pass unread;
/// without one every chunk is looked into. Checksums of chunks that are decompressed are held against their content. Of
/// a file that is cut off, what stands before the cut is read, that of its last chunk too; behind damage reading goes
/// on where records begin again.
class ChunkedFile : public MessageFile {
 public:
  [[nodiscard]] std::vector<std::string> visit(const Wants& wants,
                                               const std::function<void(const Message&)>& see) const override;
  [[nodiscard]] std::vector<Channel> channels() const override;
  [[nodiscard]] std::optional<std::vector<RecordedTimes>> recorded() const override;
  [[nodiscard]] std::shared_ptr<const Bytes> chunk(std::uint64_t place) const override;
  [[nodiscard]] std::shared_ptr<const Bytes> message(const MessagePlace& place) const override;

 protected:
  /// Up to so many bytes, as text.
  [[nodiscard]] static std::string first_bytes(const ByteSource& bytes, std::size_t count);
  /// The format outlives the file.
  ChunkedFile(std::shared_ptr<const ByteSource> bytes, const RecordFormat& format)
      : bytes_(std::move(bytes)), format_(format) {}

 private:
  std::shared_ptr<const ByteSource> bytes_;
  const RecordFormat& format_;
};

}  // namespace takt
