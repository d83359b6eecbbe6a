// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/record_walk.h"

namespace takt {

std::optional<FileRecord> RecordWalk::next() {
  if (at_ >= bytes_.size()) return std::nullopt;
  auto record = format_.record_at(bytes_, at_);
  if (record && record->end > bytes_.size()) {
    cut_off_ = record;
    return std::nullopt;
  }
  if (record) at_ = record->end;
  return record;
}

}  // namespace takt
