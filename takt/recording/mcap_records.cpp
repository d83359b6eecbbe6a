// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap_records.h"

#include <algorithm>

#include "takt/recording/output_file.h"

namespace takt::mcap {

namespace {

using Bytes = std::vector<std::byte>;

std::optional<Bytes> read_content(const ByteSource& file, const Record& record) {
  if (record.size > most_other_bytes || record.end() > file.size()) return std::nullopt;
  Bytes content(static_cast<std::size_t>(record.size));
  if (!file.read(record.content_at(), content)) return std::nullopt;
  return content;
}

MessageEncoding encoding_named(std::string_view name) {
  if (name == "ros1") return MessageEncoding::ros1;
  if (name == "cdr") return MessageEncoding::cdr;
  if (name == "json") return MessageEncoding::json;
  return MessageEncoding::other;
}

}  // namespace

std::optional<Record> record_at(ByteWindow& bytes, std::uint64_t at) {
  const auto head = bytes.at(at, record_head);
  if (head.empty()) return std::nullopt;
  ByteCursor in(head);
  Record r;
  r.op = static_cast<Op>(in.u8());
  r.at = at;
  r.size = in.u64();
  if (r.size > UINT64_MAX / 2) r.size = UINT64_MAX / 2;  // sums stay below the limit
  return r;
}

std::string_view text(ByteCursor& in) {
  return in.text(in.u32());
}

bool Channels::learn_schema(std::span<const std::byte> content) {
  ByteCursor in(content);
  const std::uint16_t id = in.u16();
  Schema schema;
  schema.name = text(in);
  schema.encoding = text(in);
  schema.definition = text(in);
  if (in.good()) schemas_.try_emplace(id, std::move(schema));
  return in.good();
}

bool Channels::learn_channel(std::span<const std::byte> content) {
  ByteCursor in(content);
  const std::uint16_t id = in.u16(), schema_id = in.u16();
  Channel channel;
  channel.topic = text(in);
  channel.encoding = encoding_named(text(in));
  if (!in.good()) return false;
  if (const auto schema = schemas_.find(schema_id); schema != schemas_.end()) {
    channel.type = plain_type(schema->second.name);
    if (schema->second.encoding == "ros1msg" || schema->second.encoding == "ros2msg")
      channel.definition = schema->second.definition;
  }
  channels_.try_emplace(id, std::move(channel));
  return true;
}

std::optional<ChunkHead> chunk_head(const ByteSource& file, const Record& record) {
  constexpr std::uint64_t enough = 128;
  Bytes head(static_cast<std::size_t>(
      std::min<std::uint64_t>({enough, record.size, file.size() - std::min(file.size(), record.content_at())})));
  if (!file.read(record.content_at(), head)) return std::nullopt;
  ByteCursor in(head);
  ChunkHead out;
  out.start_time = in.u64();
  out.end_time = in.u64();
  out.uncompressed_size = in.u64();
  out.uncompressed_crc = in.u32();
  out.compression = text(in);
  out.records_size = in.u64();
  out.records_at = record.content_at() + in.place();
  if (!in.good() || out.records_size > record.size - in.place()) return std::nullopt;
  return out;
}

bool load_chunk(const ByteSource& file, const ChunkHead& head, ChunkBuffer& into) {
  const auto compression = compression_named(head.compression);
  if (!compression || head.uncompressed_size > most_chunk_bytes || head.records_size > most_chunk_bytes ||
      head.records_at > file.size() || head.records_size > file.size() - head.records_at)
    return false;
  const auto stored_size = static_cast<std::size_t>(head.records_size);
  Bytes& first = *compression == Compression::none ? into.plain : into.stored;
  if (first.size() < stored_size) first.resize(stored_size);
  const auto stored = std::span(first).first(stored_size);
  into.size = static_cast<std::size_t>(head.uncompressed_size);
  if (!file.read(head.records_at, stored)) return false;
  if (*compression == Compression::none ? stored_size != into.size
                                        : !decompress(*compression, stored, into.size, into.plain))
    return false;
  return head.uncompressed_crc == 0 || crc32_of(into.records()) == head.uncompressed_crc;
}

std::optional<Bytes> chunk_records(const ByteSource& file, const ChunkHead& head) {
  ChunkBuffer buffer;
  if (!load_chunk(file, head, buffer)) return std::nullopt;
  buffer.plain.resize(buffer.size);
  return std::move(buffer.plain);
}

Bytes part_of_chunk(const ByteSource& file, const ChunkHead& head) {
  const auto compression = compression_named(head.compression);
  if (!compression || head.records_at >= file.size()) return {};
  Bytes input(static_cast<std::size_t>(std::min({head.records_size, file.size() - head.records_at, most_chunk_bytes})));
  if (!file.read(head.records_at, input)) return {};
  return decompress_part(*compression, input,
                         static_cast<std::size_t>(std::min(head.uncompressed_size, most_chunk_bytes)));
}

std::optional<Summary> read_summary(const ByteSource& file) {
  constexpr std::uint64_t footer_content = 20;
  const std::uint64_t tail = record_head + footer_content + magic.size();
  if (file.size() < magic.size() + tail) return std::nullopt;
  ByteWindow window(file, 0, file.size());
  const auto footer = record_at(window, file.size() - tail);
  if (!footer || footer->op != Op::footer || footer->size != footer_content) return std::nullopt;
  const std::uint64_t start = ByteCursor(window.at(footer->content_at(), 8)).u64();
  if (start < magic.size() || start >= footer->at) return std::nullopt;
  Summary out;
  for (std::uint64_t at = start; at < footer->at;) {
    const auto record = record_at(window, at);
    if (!record || record->end() > footer->at) return std::nullopt;
    at = record->end();
    if (record->op != Op::schema && record->op != Op::channel && record->op != Op::chunk_index) continue;
    const auto content = read_content(file, *record);
    if (!content) return std::nullopt;
    if (record->op == Op::schema && !out.channels.learn_schema(*content)) return std::nullopt;
    if (record->op == Op::channel && !out.channels.learn_channel(*content)) return std::nullopt;
    if (record->op != Op::chunk_index) continue;
    ByteCursor in(*content);
    in.bytes(16);  // times
    const std::uint64_t chunk_at = in.u64();
    in.u64();  // length
    ByteCursor map(in.bytes(in.u32()));
    std::set<std::uint16_t> inside;
    while (map.left() >= 10) {
      inside.insert(map.u16());
      map.u64();
    }
    if (in.good() && !inside.empty()) out.chunks[chunk_at] = std::move(inside);
  }
  return out;
}

}  // namespace takt::mcap
