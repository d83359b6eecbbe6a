// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/byte_cursor.h"
#include "takt/recording/byte_window.h"
#include "takt/recording/chunk_ahead.h"
#include "takt/recording/decompress.h"
#include "takt/recording/message_file.h"

/// The records of MCAP files, version 0: an opcode, a length, a content. https://mcap.dev/spec
namespace takt::mcap {

constexpr std::string_view magic = "\x89MCAP0\r\n";
constexpr std::uint64_t record_head = 9;    // opcode and length
constexpr std::uint64_t message_head = 22;  // channel, sequence, log and publish time
constexpr std::uint64_t most_chunk_bytes = 1ULL << 30;
constexpr std::uint64_t most_other_bytes = 1ULL << 26;  // of a schema, a channel, an index

enum class Op : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  attachment = 9,
  attachment_index = 10,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  summary_offset = 14,
  data_end = 15
};

struct Record {
  Op op{};
  std::uint64_t at = 0;    ///< of its opcode
  std::uint64_t size = 0;  ///< of its content

  [[nodiscard]] std::uint64_t content_at() const { return at + record_head; }
  [[nodiscard]] std::uint64_t end() const { return content_at() + size; }
};
/// The record that begins there; nothing where not even its head is there. Its content may reach beyond the end.
[[nodiscard]] std::optional<Record> record_at(ByteWindow& bytes, std::uint64_t at);

/// A text after its length.
[[nodiscard]] std::string_view text(ByteCursor& in);

/// What is known of channels while records go by.
class Channels {
 public:
  /// False where the record is broken.
  bool learn_schema(std::span<const std::byte> content);
  bool learn_channel(std::span<const std::byte> content);
  [[nodiscard]] const std::map<std::uint16_t, Channel>& all() const { return channels_; }

 private:
  struct Schema {
    std::string name, encoding, definition;
  };
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
};

struct ChunkHead {
  std::uint64_t start_time = 0, end_time = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: not given
  std::string compression;
  std::uint64_t records_at = 0;  ///< in the file
  std::uint64_t records_size = 0;
};
/// Nothing where it is broken; its records may reach beyond the file's end.
[[nodiscard]] std::optional<ChunkHead> chunk_head(const ByteSource& file, const Record& record);
/// Its records; nothing where they are broken, too many, or do not have their checksum.
[[nodiscard]] std::optional<std::vector<std::byte>> chunk_records(const ByteSource& file, const ChunkHead& head);
/// The same into memory that is used again; false where they are broken.
[[nodiscard]] bool load_chunk(const ByteSource& file, const ChunkHead& head, ChunkBuffer& into);
/// What can be had of a chunk that is broken or cut off.
[[nodiscard]] std::vector<std::byte> part_of_chunk(const ByteSource& file, const ChunkHead& head);

/// What the summary at the end of a file says.
struct Summary {
  Channels channels;
  std::map<std::uint64_t, std::set<std::uint16_t>> chunks;  ///< place of a chunk -> channels in it
};
/// Nothing where there is none, or a broken one.
[[nodiscard]] std::optional<Summary> read_summary(const ByteSource& file);

}  // namespace takt::mcap
