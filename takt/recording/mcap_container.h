// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "takt/recording/chunked_file.h"

namespace takt {

[[nodiscard]] bool is_mcap(std::string_view head);
[[nodiscard]] const RecordFormat& mcap_format();

class McapContainer : public ChunkedFile {
 public:
  /// Throws takt::Error where this is no MCAP file.
  McapContainer(std::shared_ptr<const ByteSource> bytes, const std::string& where);
};

}  // namespace takt
