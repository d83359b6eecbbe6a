// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap_writer.h"

#include <algorithm>
#include <utility>

#include "takt/error.h"
#include "takt/recording/byte_edit.h"
#include "takt/recording/mcap_records.h"
#include "takt/version.h"

namespace takt {

using namespace mcap;

namespace {

using Bytes = std::vector<std::byte>;
constexpr const char* compression = "zstd";
constexpr std::size_t most_channels = UINT16_MAX;

void append_record(Bytes& out, Op op, std::span<const std::byte> content) {
  append(out, static_cast<std::uint8_t>(op));
  append(out, static_cast<std::uint64_t>(content.size()));
  append(out, content);
}

Bytes record(Op op, std::span<const std::byte> content) {
  Bytes out;
  append_record(out, op, content);
  return out;
}

}  // namespace

McapWriter::McapWriter(const std::string& path, const std::string& profile, std::size_t chunk_bytes)
    : out_(path), chunk_bytes_(chunk_bytes) {
  out_.start_crc();
  out_.write(std::as_bytes(std::span(magic)));
  Bytes header;
  append_text(header, profile);
  append_text(header, std::string("takt ") + version);
  out_.write(record(Op::header, header));
}

/// At once, so that it stands before the first chunk that needs it; and again in the summary.
void McapWriter::define(const Bytes& record) {
  out_.write(record);
  append(known_, record);
}

std::uint16_t McapWriter::add_channel(const std::string& topic, const McapMessageKind& kind) {
  if (counts_.size() == most_channels) throw Error("more topics than an MCAP file can hold", topic, "write fewer");
  const auto [schema_of_kind, fresh] =
      schemas_.try_emplace(kind.schema_name, static_cast<std::uint16_t>(schemas_.size() + 1));
  if (fresh) {
    Bytes schema;
    append(schema, schema_of_kind->second);
    append_text(schema, kind.schema_name);
    append_text(schema, kind.schema_encoding);
    append_text(schema, kind.schema);
    define(record(Op::schema, schema));
  }
  const auto id = static_cast<std::uint16_t>(counts_.size() + 1);
  Bytes channel;
  append(channel, id);
  append(channel, schema_of_kind->second);
  append_text(channel, topic);
  append_text(channel, kind.message_encoding);
  append(channel, std::uint32_t{0});  // no metadata
  define(record(Op::channel, channel));
  counts_[id] = 0;
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::byte> message) {
  append(index_[channel], time_ns);
  append(index_[channel], static_cast<std::uint64_t>(chunk_.size()));
  append(chunk_, static_cast<std::uint8_t>(Op::message));
  append(chunk_, message_head + message.size());
  append(chunk_, channel);
  append(chunk_, static_cast<std::uint32_t>(counts_[channel]++));
  append(chunk_, time_ns);
  append(chunk_, time_ns);
  append(chunk_, message);
  begin_ = std::min(begin_, time_ns), end_ = std::max(end_, time_ns);
  first_ = std::min(first_, time_ns), last_ = std::max(last_, time_ns);
  ++messages_;
  if (chunk_.size() >= chunk_bytes_) write_chunk();
}

void McapWriter::finish() {
  write_chunk();
  out_.write(record(Op::data_end, bytes_of(out_.crc())));
  const std::uint64_t summary_at = out_.place();
  out_.start_crc();
  out_.write(known_);
  out_.write(record(Op::statistics, statistics()));
  out_.write(chunk_indexes_);
  Bytes footer;
  append(footer, static_cast<std::uint8_t>(Op::footer));
  append(footer, std::uint64_t{20});
  append(footer, summary_at);
  append(footer, std::uint64_t{0});  // no table of the summary's groups
  out_.write(footer);
  out_.write(bytes_of(out_.crc()));
  out_.write(std::as_bytes(std::span(magic)));
  out_.finish();
}

void McapWriter::write_chunk() {
  if (chunk_bytes_ == 0) out_.write(std::exchange(chunk_, {}));
  if (chunk_.empty()) {
    index_.clear();
    return;
  }
  const std::uint64_t at = out_.place();
  const Bytes stored = compress(*compression_named(compression), chunk_);
  Bytes content;
  append(content, begin_);
  append(content, end_);
  append(content, static_cast<std::uint64_t>(chunk_.size()));
  append(content, crc32_of(chunk_));
  append_text(content, compression);
  append(content, static_cast<std::uint64_t>(stored.size()));
  append(content, stored);
  out_.write(record(Op::chunk, content));
  const std::uint64_t indexes_at = out_.place();
  Bytes places;
  for (const auto& [id, entries] : index_) {
    append(places, id);
    append(places, out_.place());
    Bytes index;
    append(index, id);
    append(index, static_cast<std::uint32_t>(entries.size()));
    append(index, entries);
    out_.write(record(Op::message_index, index));
  }
  Bytes summary;
  append(summary, begin_);
  append(summary, end_);
  append(summary, at);
  append(summary, indexes_at - at);
  append(summary, static_cast<std::uint32_t>(places.size()));
  append(summary, places);
  append(summary, out_.place() - indexes_at);
  append_text(summary, compression);
  append(summary, static_cast<std::uint64_t>(stored.size()));
  append(summary, static_cast<std::uint64_t>(chunk_.size()));
  append_record(chunk_indexes_, Op::chunk_index, summary);
  ++chunks_;
  chunk_.clear();
  index_.clear();
  begin_ = UINT64_MAX, end_ = 0;
}

McapWriter::Bytes McapWriter::statistics() const {
  Bytes out;
  append(out, messages_);
  append(out, static_cast<std::uint16_t>(schemas_.size()));
  append(out, static_cast<std::uint32_t>(counts_.size()));
  append(out, std::uint32_t{0});  // attachments
  append(out, std::uint32_t{0});  // metadata
  append(out, chunks_);
  append(out, messages_ == 0 ? 0 : first_);
  append(out, last_);
  append(out, static_cast<std::uint32_t>(10 * counts_.size()));
  for (const auto& [id, count] : counts_) {
    append(out, id);
    append(out, count);
  }
  return out;
}

}  // namespace takt
