// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/record_format.h"

#include <algorithm>

#include "takt/recording/output_file.h"

namespace takt {

namespace {

constexpr std::uint64_t most_chunk_bytes = 1ULL << 30;

}  // namespace

bool load_records(const ByteSource& file, const StoredRecords& records, ChunkBuffer& into) {
  if (records.plain_size > most_chunk_bytes || records.size > most_chunk_bytes || records.at > file.size() ||
      records.size > file.size() - records.at)
    return false;
  const bool plain = records.compression == Compression::none;
  auto& first = plain ? into.plain : into.stored;
  const auto stored_size = static_cast<std::size_t>(records.size);
  if (first.size() < stored_size) first.resize(stored_size);
  const auto stored = std::span(first).first(stored_size);
  into.size = static_cast<std::size_t>(records.plain_size);
  if (!file.read(records.at, stored)) return false;
  if (plain ? stored_size != into.size : !into.decompressor.run(records.compression, stored, into.size, into.plain))
    return false;
  return records.crc == 0 || crc32_of(into.records()) == records.crc;
}

std::vector<std::byte> load_part(const ByteSource& file, const StoredRecords& records) {
  if (records.at >= file.size()) return {};
  std::vector<std::byte> stored(
      static_cast<std::size_t>(std::min({records.size, file.size() - records.at, most_chunk_bytes})));
  if (!file.read(records.at, stored)) return {};
  return decompress_part(records.compression, stored,
                         static_cast<std::size_t>(std::min(records.plain_size, most_chunk_bytes)));
}

}  // namespace takt
