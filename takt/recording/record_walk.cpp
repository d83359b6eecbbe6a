// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/record_walk.h"

#include <algorithm>

namespace takt {

namespace {

using Kind = FileRecord::Kind;

/// Messages next to each other are not recorded further apart, unless they are no messages.
constexpr Duration most_apart = std::chrono::hours(1);

}  // namespace

std::optional<FileRecord> RecordWalk::next() {
  while (at_ < bytes_.size()) {
    const auto record = format_.record_at(bytes_, at_);
    if (record && record->end <= bytes_.size() && is_believed(*record)) {
      // A message's length says nothing about itself; a chunk's is held against others.
      doubt_from_ = record->at + 1;
      search_from_ = record->kind == Kind::message || !record->certain ? doubt_from_ : 0;
      at_ = record->end;
      return record;
    }
    if (record && record->end > bytes_.size()) cut_off_ = record;
    const bool ends_in_plain_chunk = cut_off_ && cut_off_->kind == Kind::chunk && cut_off_->certain &&
                                     cut_off_->records.compression == Compression::none;
    if (ends_in_plain_chunk) break;
    const std::uint64_t from = search_from_ != 0 ? search_from_ : at_ + 1;
    const auto found = search(from);
    if (!found) break;
    cut_off_.reset();
    if (damage_.places++ == 0) damage_.first_at = from - 1;
    damage_.bytes += *found - (from - 1);
    at_ = *found;
    search_from_ = 0;
  }
  return std::nullopt;
}

/// Kinds that we do not know are allowed; then at least another record has to follow.
bool RecordWalk::is_believed(const FileRecord& record) const {
  if (record.broken) return false;
  const bool known = record.kind != Kind::other && record.kind != Kind::unknown;
  if (record.certain || known || record.end == bytes_.size()) return true;
  return format_.record_at(bytes_, record.end).has_value();
}

bool RecordWalk::holds(std::uint64_t at) const {
  constexpr int in_a_row = 3;
  std::optional<Stamp> last;
  for (int i = 0; i < in_a_row; ++i) {
    const auto record = format_.record_at(bytes_, at);
    if (!record) return false;
    if (record->kind == Kind::zeros) return i > 0;
    const bool only_begun = record->end == bytes_.size() + 1;  // not even its head is there
    if (i > 0 && (only_begun || (record->certain && record->end > bytes_.size()))) return true;
    if (!record->certain || record->end > bytes_.size()) return false;
    if (record->kind == Kind::end) return true;
    if (record->kind == Kind::message) {
      if (last && std::max(*last, record->recorded) - std::min(*last, record->recorded) > most_apart) return false;
      last = record->recorded;
    }
    at = record->end;
    if (at == bytes_.size()) return true;
  }
  return true;
}

std::optional<std::uint64_t> RecordWalk::search(std::uint64_t from) const {
  while (const auto place = format_.candidate(bytes_, from)) {
    if (holds(*place)) return place;
    from = *place + 1;
  }
  return std::nullopt;
}

}  // namespace takt
