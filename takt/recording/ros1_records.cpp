// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_records.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "takt/recording/byte_cursor.h"

namespace takt::ros1 {

namespace {

constexpr std::uint32_t most_header_bytes = 1U << 20;
constexpr std::uint32_t most_chunk_bytes = 1U << 29;  // rosbag's own default is 768 kB
constexpr std::int64_t second_ns = 1'000'000'000;

std::optional<std::uint32_t> read_u32(const ByteSource& file, std::uint64_t at) {
  std::array<std::byte, 4> bytes{};
  if (!file.read(at, bytes)) return std::nullopt;
  return ByteCursor(bytes).u32();
}

Stamp read_time(ByteCursor& in) {
  const std::int64_t s = in.u32(), ns = in.u32();
  return from_ns(s * second_ns + ns);
}

}  // namespace

bool read_fields(std::span<const std::byte> bytes, Header& header) {
  ByteCursor in(bytes);
  while (in.left() > 0) {
    const std::string_view field = in.text(in.u32());
    const std::size_t equals = field.find('=');
    if (!in.good() || equals == std::string_view::npos) return false;
    const std::string_view name = field.substr(0, equals), value = field.substr(equals + 1);
    const std::size_t value_at = in.place() - value.size();
    ByteCursor number(std::as_bytes(std::span(value)));
    if (name == "op") header.op = static_cast<Op>(number.u8());
    if (name == "conn") header.connection = number.u32();
    if (name == "size") header.size = number.u32();
    if (name == "time") header.time = read_time(number), header.time_at = value_at;
    if (name == "start_time") header.start_time = read_time(number), header.start_time_at = value_at;
    if (name == "end_time") header.end_time = read_time(number), header.end_time_at = value_at;
    if (name == "index_pos" || name == "chunk_pos") header.place = number.u64(), header.place_at = value_at;
    if (name == "topic") header.topic = value;
    if (name == "type") header.type = value;
    if (name == "compression") header.compression = value;
    if (name == "message_definition") header.definition = value;
    if (!number.good()) return false;
  }
  return true;
}

bool put_time(std::span<std::byte> out, Stamp time) {
  const std::int64_t s = to_ns(time) / second_ns, ns = to_ns(time) % second_ns;
  if (to_ns(time) < 0 || s > std::numeric_limits<std::uint32_t>::max() || out.size() < 8) return false;
  const auto seconds = static_cast<std::uint32_t>(s), rest = static_cast<std::uint32_t>(ns);
  std::memcpy(out.data(), &seconds, sizeof seconds);
  std::memcpy(out.data() + sizeof seconds, &rest, sizeof rest);
  return true;
}

bool learn_connection(const Header& header, std::span<const std::byte> data, Connections& connections) {
  Header fields;
  if (!header.connection || !read_fields(data, fields)) return false;
  connections.try_emplace(*header.connection, Channel{std::string(header.topic), std::string(fields.type),
                                                      MessageEncoding::ros1, std::string(fields.definition)});
  return true;
}

std::uint64_t after_zeros(const ByteSource& file, std::uint64_t at) {
  std::vector<std::byte> block(1U << 16);
  for (; at < file.size(); at += block.size()) {
    block.resize(static_cast<std::size_t>(std::min<std::uint64_t>(block.size(), file.size() - at)));
    if (!file.read(at, block)) break;
    const auto other = std::find_if(block.begin(), block.end(), [](std::byte b) { return b != std::byte{0}; });
    if (other != block.end()) return at + static_cast<std::uint64_t>(other - block.begin());
  }
  return file.size();
}

Found read_record(const ByteSource& file, std::uint64_t at, Record& out) {
  out.header = {};
  out.data_size = 0;
  const auto header_size = read_u32(file, at);
  if (!header_size) return Found::cut_off;
  if (*header_size > most_header_bytes) return Found::broken;
  if (at + 8 + *header_size > file.size()) return Found::cut_off;
  out.header_bytes.resize(*header_size);
  if (!file.read(at + 4, out.header_bytes)) return Found::cut_off;
  Header header;
  if (!read_fields(out.header_bytes, header)) return Found::broken;
  const auto data_size = read_u32(file, at + 4 + *header_size);
  if (!data_size) return Found::cut_off;
  out.header = header;
  out.data_at = at + 8 + *header_size;
  out.data_size = *data_size;
  return out.end() > file.size() ? Found::cut_off : Found::record;
}

std::optional<std::vector<std::byte>> read_data(const ByteSource& file, const Record& record) {
  std::vector<std::byte> data(record.data_size);  // its size was checked against the file's
  if (!file.read(record.data_at, data)) return std::nullopt;
  return data;
}

bool load_chunk(const ByteSource& file, const Record& record, ChunkBuffer& into) {
  const auto compression = compression_named(record.header.compression);
  if (!record.header.size || *record.header.size > most_chunk_bytes || record.data_size > most_chunk_bytes ||
      !compression)
    return false;
  into.size = *record.header.size;
  auto& first = *compression == Compression::none ? into.plain : into.stored;
  if (first.size() < record.data_size) first.resize(record.data_size);
  const auto stored = std::span(first).first(record.data_size);
  if (!file.read(record.data_at, stored)) return false;
  if (*compression == Compression::none) return record.data_size == into.size;
  return decompress(*compression, stored, into.size, into.plain);
}

std::optional<std::vector<std::byte>> read_chunk(const ByteSource& file, const Record& record) {
  ChunkBuffer buffer;
  if (!load_chunk(file, record, buffer)) return std::nullopt;
  buffer.plain.resize(buffer.size);
  return std::move(buffer.plain);
}

std::vector<std::byte> read_part_of_chunk(const ByteSource& file, const Record& record) {
  const auto compression = compression_named(record.header.compression);
  if (!compression || record.data_at >= file.size()) return {};
  const std::uint64_t there =
      std::min<std::uint64_t>({record.data_size, file.size() - record.data_at, most_chunk_bytes});
  std::vector<std::byte> data(static_cast<std::size_t>(there));
  if (!file.read(record.data_at, data)) return {};
  return decompress_part(*compression, data, std::min(record.header.size.value_or(0), most_chunk_bytes));
}

std::optional<Index> read_index(const ByteSource& file) {
  Record record;
  if (read_record(file, magic.size(), record) != Found::record || record.header.op != Op::bag) return std::nullopt;
  std::uint64_t at = record.header.place.value_or(0);
  if (at <= magic.size() || at >= file.size()) return std::nullopt;
  Index index;
  for (; at < file.size(); at = record.end()) {
    if (read_record(file, at, record) != Found::record) return std::nullopt;
    const auto data = read_data(file, record);
    if (!data) return std::nullopt;
    if (record.header.op == Op::connection) {
      if (!learn_connection(record.header, *data, index.connections)) return std::nullopt;
    } else if (record.header.op == Op::chunk_info && record.header.place) {
      auto& inside = index.chunks[*record.header.place];
      for (ByteCursor in(*data); in.left() >= 8;) {
        inside.push_back(in.u32());
        in.u32();  // how many messages
      }
    } else {
      return std::nullopt;
    }
  }
  return index;
}

}  // namespace takt::ros1
