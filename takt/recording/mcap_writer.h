// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "takt/recording/output_file.h"

namespace takt {

/// What a channel's messages are.
struct McapMessageKind {
  std::string schema_name, schema_encoding, schema;
  std::string message_encoding;
};

/// A new MCAP file with chunks, their indexes, a summary and statistics. Throws takt::Error.
class McapWriter {
 public:
  static constexpr std::size_t usual_chunk_bytes = 1U << 20;

  /// `chunk_bytes` 0: no chunks; each message goes out as it comes, so that a crash loses none.
  McapWriter(const std::string& path, const std::string& profile, std::size_t chunk_bytes = usual_chunk_bytes);

  /// Channels are numbered from 1 and may be added at any time.
  std::uint16_t add_channel(const std::string& topic, const McapMessageKind& kind);
  void write(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::byte> message);
  void finish();

 private:
  using Bytes = std::vector<std::byte>;
  void define(const Bytes& record);
  void write_chunk();
  [[nodiscard]] Bytes statistics() const;

  OutputFile out_;
  std::size_t chunk_bytes_;
  Bytes known_;  // schemas and channels, for the summary
  std::map<std::string, std::uint16_t> schemas_;
  Bytes chunk_, chunk_indexes_;
  std::map<std::uint16_t, Bytes> index_;  // of the chunk
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::uint64_t messages_ = 0;
  std::uint32_t chunks_ = 0;
  std::uint64_t begin_ = UINT64_MAX, end_ = 0;   // of the chunk
  std::uint64_t first_ = UINT64_MAX, last_ = 0;  // of the file
};

}  // namespace takt
