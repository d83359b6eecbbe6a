// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "takt/recording/byte_cursor.h"
#include "takt/recording/byte_window.h"
#include "takt/recording/record_format.h"

/// The records of MCAP files, version 0: an opcode, a length, a content. https://mcap.dev/spec
namespace takt::mcap {

constexpr std::string_view magic = "\x89MCAP0\r\n";
constexpr std::uint64_t record_head = 9;                // opcode and length
constexpr std::uint64_t message_head = 22;              // channel, sequence, log and publish time
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
[[nodiscard]] std::optional<Record> head_at(ByteWindow& bytes, std::uint64_t at);

/// A text after its length.
[[nodiscard]] std::string_view text(ByteCursor& in);

/// A schema's or a channel's content; false where it is broken.
[[nodiscard]] bool learn(Op op, std::span<const std::byte> content, KnownChannels& known);

struct ChunkHead {
  std::uint64_t start_time = 0, end_time = 0;
  std::string compression;  ///< as it stands there
  StoredRecords records;
};
/// Nothing where it is broken; its records may reach beyond the file's end.
[[nodiscard]] std::optional<ChunkHead> chunk_head(ByteWindow& bytes, const Record& record);

}  // namespace takt::mcap
