// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap_records.h"

#include <algorithm>

namespace takt::mcap {

namespace {

MessageEncoding encoding_named(std::string_view name) {
  if (name == "ros1") return MessageEncoding::ros1;
  if (name == "cdr") return MessageEncoding::cdr;
  if (name == "json") return MessageEncoding::json;
  return MessageEncoding::other;
}

}  // namespace

std::optional<Record> head_at(ByteWindow& bytes, std::uint64_t at) {
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

bool learn(Op op, std::span<const std::byte> content, KnownChannels& known) {
  ByteCursor in(content);
  const std::uint16_t id = in.u16();
  if (op == Op::schema) {
    KnownChannels::Schema schema;
    schema.name = text(in);
    schema.encoding = text(in);
    schema.definition = text(in);
    if (in.good()) known.schemas.try_emplace(id, std::move(schema));
    return in.good();
  }
  const std::uint16_t schema_id = in.u16();
  Channel channel;
  channel.topic = text(in);
  channel.encoding = encoding_named(text(in));
  if (!in.good()) return false;
  if (const auto schema = known.schemas.find(schema_id); schema != known.schemas.end()) {
    channel.type = plain_type(schema->second.name);
    if (schema->second.encoding == "ros1msg" || schema->second.encoding == "ros2msg")
      channel.definition = schema->second.definition;
  }
  known.channels.try_emplace(id, std::move(channel));
  return true;
}

std::optional<ChunkHead> chunk_head(ByteWindow& bytes, const Record& record) {
  constexpr std::uint64_t enough = 128;
  const std::uint64_t there = bytes.size() - std::min(bytes.size(), record.content_at());
  ByteCursor in(bytes.at(record.content_at(), std::min({enough, record.size, there})));
  ChunkHead out;
  out.start_time = in.u64();
  out.end_time = in.u64();
  out.records.plain_size = in.u64();
  out.records.crc = in.u32();
  out.compression = text(in);
  const auto compression = compression_named(out.compression);
  out.records.size = in.u64();
  out.records.at = record.content_at() + in.place();
  if (!in.good() || !compression || out.records.size > record.size - in.place()) return std::nullopt;
  out.records.compression = *compression;
  return out;
}

}  // namespace takt::mcap
