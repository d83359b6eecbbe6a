// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <string>

#include "takt/recording/mcap_writer.h"

namespace takt {

/// Events as JSON messages in an MCAP file, one channel a topic, each written as it comes. The file bears another name
/// until it is finished; after a crash what was written is readable under that name. Throws takt::Error.
class EventFile {
 public:
  explicit EventFile(std::string path);

  void write(const std::string& topic, std::uint64_t time_ns, const std::string& json);
  void finish();

 private:
  std::string path_;
  McapWriter file_;
  std::map<std::string, std::uint16_t> channels_;
};

}  // namespace takt
