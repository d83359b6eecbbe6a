// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_container.h"

#include <algorithm>
#include <array>

#include "takt/error.h"
#include "takt/recording/byte_cursor.h"
#include "takt/recording/ros1_records.h"

namespace takt {

using namespace ros1;

namespace {

using Kind = FileRecord::Kind;

/// The first byte from `at` on that is not zero, or the end. A record never starts with a zero byte, because its header
/// has a length.
std::uint64_t after_zeros(ByteWindow& bytes, std::uint64_t at) {
  constexpr std::uint64_t look = 1U << 16;
  while (at < bytes.size()) {
    const auto block = bytes.at(at, std::min(look, bytes.size() - at));
    const auto other = std::find_if(block.begin(), block.end(), [](std::byte b) { return b != std::byte{0}; });
    if (other != block.end() || block.empty()) return at + static_cast<std::uint64_t>(other - block.begin());
    at += block.size();
  }
  return at;
}

/// A chunk's info: where it is, and how many messages of which connections are in it.
void learn_chunk(std::uint64_t place, std::span<const std::byte> data, FileIndex& index) {
  auto& inside = index.chunks[place];
  for (ByteCursor in(data); in.left() >= 8;) {
    inside.push_back(in.u32());
    in.u32();  // how many
  }
}

class Ros1Format : public RecordFormat {
 public:
  [[nodiscard]] std::uint64_t first_record() const override { return magic.size(); }
  [[nodiscard]] bool has_end_record() const override { return false; }

  [[nodiscard]] std::optional<FileRecord> record_at(ByteWindow& bytes, std::uint64_t at) const override {
    Record record;
    FileRecord out;
    out.at = at;
    switch (head_at(bytes, at, record)) {
      case Found::broken:
        return std::nullopt;
      case Found::cut_off:
        out.end = bytes.size() + 1;
        return out;
      case Found::record:
        break;
    }
    out.end = record.end();
    out.data_at = record.data_at;
    const Header& header = record.header;
    if (record.header_bytes.empty() && record.data_size == 0) {
      out.kind = Kind::zeros;
      out.end = after_zeros(bytes, at);
    } else {
      read_fields(header, record, out);
    }
    return out;
  }

  [[nodiscard]] std::optional<std::uint64_t> candidate(ByteWindow& bytes, std::uint64_t from) const override {
    // Every header has the field "op=" of four bytes; it stands among others, which are short.
    static constexpr std::array pattern{std::byte{4},   std::byte{0},   std::byte{0},  std::byte{0},
                                        std::byte{'o'}, std::byte{'p'}, std::byte{'='}};
    constexpr std::uint64_t look = 1U << 16, most_before = 160;
    for (std::uint64_t at = from; at + pattern.size() <= bytes.size();) {
      const auto block = bytes.at(at, std::min(look, bytes.size() - at));
      const auto found = std::search(block.begin(), block.end(), pattern.begin(), pattern.end());
      const std::uint64_t field_at = at + static_cast<std::uint64_t>(found - block.begin());
      if (found == block.end()) {
        if (block.size() < pattern.size()) break;
        at += block.size() - (pattern.size() - 1);
        continue;
      }
      Record record;
      for (std::uint64_t p = std::max(from, field_at - std::min(field_at, most_before)); p + 4 <= field_at; ++p)
        if (head_at(bytes, p, record) == Found::record && record.header.op != Op::none) return p;
      at = field_at + 1;
    }
    return std::nullopt;
  }

  bool learn(ByteWindow& bytes, const FileRecord& record, KnownChannels& known) const override {
    Record head;
    if (head_at(bytes, record.at, head) != Found::record) return false;
    const auto all = bytes.at(record.at, record.end - record.at);  // its header again, together with its data
    return !all.empty() && head_at(bytes, record.at, head) == Found::record &&
           ros1::learn(head.header, all.subspan(record.data_at - record.at), known);
  }

  void read_times(ByteWindow& bytes, const FileRecord& index, std::vector<Stamp>& times) const override {
    constexpr std::uint64_t entry = 12;  // time and place
    for (std::uint64_t i = 0; i < index.count; ++i) {
      ByteCursor in(bytes.at(index.data_at + i * entry, entry));
      times.push_back(read_time(in));
    }
  }

  [[nodiscard]] std::optional<FileIndex> read_index(const ByteSource& file) const override {
    ByteWindow window(file, 0, file.size());
    Record record;
    if (head_at(window, magic.size(), record) != Found::record || record.header.op != Op::bag) return std::nullopt;
    std::uint64_t at = record.header.place.value_or(0);
    if (at <= magic.size() || at >= file.size()) return std::nullopt;
    FileIndex index;
    while (at < file.size()) {
      const auto found = record_at(window, at);
      if (!found || found->end > file.size()) return std::nullopt;
      if (found->kind == Kind::channel) {
        if (!learn(window, *found, index.known)) return std::nullopt;
      } else {
        if (head_at(window, at, record) != Found::record || record.header.op != Op::chunk_info || !record.header.place)
          return std::nullopt;
        const std::uint64_t place = *record.header.place;
        learn_chunk(place, window.at(record.data_at, record.data_size), index);
      }
      at = found->end;
    }
    return index;
  }

 private:
  static void read_fields(const Header& header, const Record& record, FileRecord& out) {
    const auto compression = compression_named(header.compression);
    const bool has_connection = header.connection.has_value();
    out.channel = header.connection.value_or(0);
    switch (header.op) {
      case Op::connection:
        out.kind = Kind::channel;
        out.certain = has_connection && !header.topic.empty();
        break;
      case Op::message:
        out.kind = Kind::message;
        out.recorded = header.time.value_or(Stamp{});
        out.broken = !has_connection;
        out.certain = has_connection && header.time;
        break;
      case Op::chunk:
        out.kind = Kind::chunk;
        out.broken =
            !compression || !header.size || (compression == Compression::none && header.size != record.data_size);
        out.records = {compression.value_or(Compression::none), record.data_at, record.data_size,
                       header.size.value_or(0), 0};
        out.certain = !out.broken;
        break;
      case Op::index:
        out.kind = Kind::index;
        out.count = record.data_size / 12;
        out.certain = has_connection && record.data_size % 12 == 0;
        break;
      case Op::chunk_info:
      case Op::bag:
        out.certain = header.place.has_value();
        break;
      case Op::none:
        break;
    }
  }
};

}  // namespace

bool is_ros1_bag(std::string_view head) {
  return head.starts_with(magic);
}

const RecordFormat& ros1_format() {
  static const Ros1Format format;
  return format;
}

Ros1Container::Ros1Container(std::shared_ptr<const ByteSource> bytes, const std::string& where)
    : ChunkedFile(bytes, ros1_format()) {
  const std::string head = first_bytes(*bytes, magic.size());
  if (!is_ros1_bag(head)) {
    const bool older = head.starts_with("#ROSBAG") || head.starts_with("#ROSRECORD");
    throw Error(older ? "is a bag of another version than 2.0" : "is no ROS 1 bag", where,
                older ? "convert it with `rosbag fix`" : "check that the copy is complete");
  }
}

}  // namespace takt
