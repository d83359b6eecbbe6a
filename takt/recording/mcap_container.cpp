// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap_container.h"

#include <algorithm>
#include <set>

#include "takt/error.h"
#include "takt/recording/mcap_records.h"

namespace takt {

using namespace mcap;

namespace {

using Kind = FileRecord::Kind;

constexpr std::uint64_t footer_content = 20;
constexpr std::uint64_t most_message_bytes = 1ULL << 30;

std::optional<Record> read_footer(ByteWindow& file) {
  const std::uint64_t tail = record_head + footer_content + magic.size();
  if (file.size() < magic.size() + tail) return std::nullopt;
  const auto footer = head_at(file, file.size() - tail);
  const bool good = footer && footer->op == Op::footer && footer->size == footer_content;
  return good ? footer : std::nullopt;
}

/// The place of a chunk, and which channels are in it. False where the record is broken.
bool learn_chunk(std::span<const std::byte> content, FileIndex& index) {
  ByteCursor in(content);
  in.bytes(16);  // times
  const std::uint64_t chunk_at = in.u64();
  in.u64();  // length
  ByteCursor places(in.bytes(in.u32()));
  std::set<std::uint32_t> inside;
  while (places.left() >= 10) {
    inside.insert(places.u16());
    places.u64();
  }
  if (in.good() && !inside.empty()) index.chunks[chunk_at].assign(inside.begin(), inside.end());
  return in.good();
}

/// The inner lengths of a schema, a channel, a header or metadata add up to the outer one.
bool lengths_agree(Op op, std::span<const std::byte> content) {
  ByteCursor in(content);
  int texts = op == Op::schema ? 3 : 2;  // metadata: a name and a map
  if (op == Op::schema) in.u16();
  if (op == Op::channel) in.u32(), texts = 3;  // the last is a map
  for (int i = 0; i < texts; ++i) in.bytes(in.u32());
  return in.good() && in.left() == 0;
}

class McapFormat : public RecordFormat {
 public:
  [[nodiscard]] std::uint64_t first_record() const override { return magic.size(); }
  [[nodiscard]] bool has_end_record() const override { return true; }

  [[nodiscard]] std::optional<FileRecord> record_at(ByteWindow& bytes, std::uint64_t at) const override {
    FileRecord out;
    out.at = at;
    const auto record = head_at(bytes, at);
    if (!record) {
      out.end = bytes.size() + 1;  // not even its head is there
      return out;
    }
    if (static_cast<int>(record->op) == 0) return std::nullopt;
    out.end = record->end();
    out.data_at = record->content_at();
    switch (record->op) {
      case Op::schema:
      case Op::channel:
        out.kind = Kind::channel;
        [[fallthrough]];
      case Op::header:
      case Op::metadata:
        out.certain =
            record->size <= most_other_bytes && lengths_agree(record->op, bytes.at(record->content_at(), record->size));
        break;
      case Op::message:
        out.kind = Kind::message;
        read_message(bytes, *record, out);
        break;
      case Op::chunk:
        out.kind = Kind::chunk;
        read_chunk(bytes, *record, out);
        break;
      case Op::message_index:
        out.kind = Kind::index;
        read_message_index(bytes, *record, out);
        break;
      case Op::data_end:
      case Op::footer:
        out.kind = Kind::end;
        out.certain = record->size == (record->op == Op::data_end ? 4 : footer_content);
        break;
      default:
        if (record->op > Op::data_end) out.kind = Kind::unknown;
        break;
    }
    return out;
  }

  [[nodiscard]] std::optional<std::uint64_t> candidate(ByteWindow& bytes, std::uint64_t from) const override {
    constexpr std::uint64_t look = 1U << 16;
    while (from + record_head <= bytes.size()) {
      const auto block = bytes.at(from, std::min(look, bytes.size() - from));
      if (block.empty()) return std::nullopt;
      for (std::size_t i = 0; i + record_head <= block.size(); ++i) {
        const auto zero = [&](std::size_t k) { return block[i + k] == std::byte{0}; };
        const auto op = static_cast<unsigned>(block[i]);
        if (op != 0 && op <= static_cast<unsigned>(Op::data_end) && zero(8) && zero(7) && zero(6)) return from + i;
      }
      from += block.size() - (record_head - 1);
    }
    return std::nullopt;
  }

  bool learn(ByteWindow& bytes, const FileRecord& record, KnownChannels& known) const override {
    const auto head = head_at(bytes, record.at);
    return head && head->size <= most_other_bytes &&
           mcap::learn(head->op, bytes.at(head->content_at(), head->size), known);
  }

  void read_times(ByteWindow& bytes, const FileRecord& index, std::vector<Stamp>& times) const override {
    constexpr std::uint64_t head = 6, entry = 16;  // channel and size; time and place
    for (std::uint64_t i = 0; i < index.count; ++i)
      times.push_back(
          from_ns(static_cast<std::int64_t>(ByteCursor(bytes.at(index.data_at + head + i * entry, entry)).u64())));
  }

  [[nodiscard]] std::optional<FileIndex> read_index(const ByteSource& file) const override {
    ByteWindow window(file, 0, file.size());
    const auto footer = read_footer(window);
    if (!footer) return std::nullopt;
    const std::uint64_t start = ByteCursor(window.at(footer->content_at(), 8)).u64();
    if (start < magic.size() || start >= footer->at) return std::nullopt;
    FileIndex out;
    for (std::uint64_t at = start; at < footer->at;) {
      const auto record = head_at(window, at);
      if (!record || record->end() > footer->at) return std::nullopt;
      at = record->end();
      if (record->op != Op::schema && record->op != Op::channel && record->op != Op::chunk_index) continue;
      if (record->size > most_other_bytes) return std::nullopt;
      const auto content = window.at(record->content_at(), record->size);
      const bool good =
          record->op == Op::chunk_index ? learn_chunk(content, out) : mcap::learn(record->op, content, out.known);
      if (!good) return std::nullopt;
    }
    return out;
  }

 private:
  static void read_chunk(ByteWindow& bytes, const Record& record, FileRecord& out) {
    const auto head = chunk_head(bytes, record);
    out.broken = !head || head->records.at + head->records.size != out.end;
    if (!head) return;
    out.records = head->records;
    out.certain = !out.broken && head->start_time <= head->end_time;
  }
  static void read_message_index(ByteWindow& bytes, const Record& record, FileRecord& out) {
    ByteCursor in(bytes.at(record.content_at(), 6));
    out.channel = in.u16();
    const std::uint32_t size = in.u32();
    out.count = size / 16;
    out.certain = in.good() && size % 16 == 0 && 6ULL + size == record.size;
  }
  static void read_message(ByteWindow& bytes, const Record& record, FileRecord& out) {
    ByteCursor in(bytes.at(record.content_at(), message_head));
    out.channel = in.u16();
    in.u32();  // sequence
    out.recorded = from_ns(static_cast<std::int64_t>(in.u64()));
    out.broken = record.size < message_head || !in.good();
    out.certain = !out.broken && record.size < most_message_bytes && to_ns(out.recorded) >= 0;
    out.data_at = record.content_at() + message_head;
  }
};

}  // namespace

bool is_mcap(std::string_view head) {
  return head.starts_with(magic);
}

const RecordFormat& mcap_format() {
  static const McapFormat format;
  return format;
}

McapContainer::McapContainer(std::shared_ptr<const ByteSource> bytes, const std::string& where)
    : ChunkedFile(bytes, mcap_format()) {
  if (!is_mcap(first_bytes(*bytes, magic.size())))
    throw Error("is no MCAP file", where, "check that the copy is complete");
}

}  // namespace takt
