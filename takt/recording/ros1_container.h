// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "takt/recording/chunked_file.h"

namespace takt {

[[nodiscard]] bool is_ros1_bag(std::string_view head);
[[nodiscard]] const RecordFormat& ros1_format();

class Ros1Container : public ChunkedFile {
 public:
  /// Throws takt::Error where this is no bag of version 2.0.
  Ros1Container(std::shared_ptr<const ByteSource> bytes, const std::string& where);
};

}  // namespace takt
