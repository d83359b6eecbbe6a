// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

#include "takt/recording/record_format.h"

namespace takt {

/// The records of a file or of a chunk, one after the other.
class RecordWalk {
 public:
  RecordWalk(const RecordFormat& format, ByteWindow& bytes, std::uint64_t from)
      : format_(format), bytes_(bytes), at_(from) {}

  /// The next whole record; nothing at the end and where it breaks off.
  [[nodiscard]] std::optional<FileRecord> next();
  /// Where it stands: behind the last record.
  [[nodiscard]] std::uint64_t place() const { return at_; }
  [[nodiscard]] bool broke_off() const { return at_ < bytes_.size(); }
  /// The record that reaches beyond the end.
  [[nodiscard]] const std::optional<FileRecord>& cut_off() const { return cut_off_; }

 private:
  const RecordFormat& format_;
  ByteWindow& bytes_;
  std::uint64_t at_;
  std::optional<FileRecord> cut_off_;
};

}  // namespace takt
