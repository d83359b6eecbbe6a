// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap.h"

#include "takt/recording/mcap_container.h"
#include "takt/recording/message_streams.h"

namespace takt {

bool looks_like_mcap(const std::string& path) {
  const std::string head = file_head(path, 8);
  return is_mcap(head) || (path.ends_with(".mcap") && !head.empty());
}

Recording read_mcap(const std::string& path, const OpenOptions&) {
  return read_mcap(open_bytes(path), path);
}

Recording read_mcap(std::shared_ptr<const ByteSource> bytes, const std::string& path) {
  return message_streams(std::make_shared<const McapContainer>(std::move(bytes), path), path,
                         "copy the file again, or try `mcap recover`");
}

}  // namespace takt
