// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <string>

#include "takt/recording/output_file.h"

namespace takt {

/// An MCAP file of JSON messages, written as they come: one channel a topic. It bears another name until it is
/// finished; after a crash what was written is readable under that name. Throws takt::Error.
class McapWriter {
 public:
  explicit McapWriter(const std::string& path);

  void write(const std::string& topic, std::uint64_t time_ns, const std::string& json);
  /// Statistics and footer, then the final name.
  void finish();

 private:
  std::uint16_t channel_of(const std::string& topic);
  [[nodiscard]] std::string channel_record(std::uint16_t id, const std::string& topic) const;

  std::string path_;
  OutputFile out_;
  struct Channel {
    std::uint16_t id = 0;
    std::uint64_t messages = 0;
  };
  std::map<std::string, Channel> channels_;
  std::uint64_t messages_ = 0, first_ns_ = 0, last_ns_ = 0;
};

}  // namespace takt
