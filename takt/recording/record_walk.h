// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

#include "takt/recording/record_format.h"

namespace takt {

/// The records of a file or of a chunk, one after the other. Behind damage the next record is searched for: where three
/// in a row have lengths that agree, it goes on.
class RecordWalk {
 public:
  struct Damage {
    std::uint64_t places = 0, bytes = 0;
    std::uint64_t first_at = 0;
  };

  RecordWalk(const RecordFormat& format, ByteWindow& bytes, std::uint64_t from)
      : format_(format), bytes_(bytes), at_(from) {}

  /// The next whole record; nothing at the end and where the rest has none. It may begin before the last one's end,
  /// where that one's length turned out to be wrong.
  [[nodiscard]] std::optional<FileRecord> next();
  /// The last record did not hold what it should: unless another one follows it, its length is not believed either.
  void doubt_last() { search_from_ = doubt_from_; }

  [[nodiscard]] const Damage& damage() const { return damage_; }
  /// Where it stands: behind the last record.
  [[nodiscard]] std::uint64_t place() const { return at_; }
  [[nodiscard]] bool broke_off() const { return at_ < bytes_.size(); }
  /// The record that reaches beyond the end.
  [[nodiscard]] const std::optional<FileRecord>& cut_off() const { return cut_off_; }

 private:
  [[nodiscard]] bool is_believed(const FileRecord& record) const;
  [[nodiscard]] bool holds(std::uint64_t at) const;
  [[nodiscard]] std::optional<std::uint64_t> search(std::uint64_t from) const;

  const RecordFormat& format_;
  ByteWindow& bytes_;
  std::uint64_t at_;
  std::uint64_t search_from_ = 0;  // 0: behind the place where it broke
  std::uint64_t doubt_from_ = 0;
  Damage damage_;
  std::optional<FileRecord> cut_off_;
};

}  // namespace takt
