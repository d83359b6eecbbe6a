// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_records.h"

#include <cstring>
#include <limits>

#include "takt/recording/byte_cursor.h"

namespace takt::ros1 {

namespace {

constexpr std::uint32_t most_header_bytes = 1U << 20;
constexpr std::int64_t second_ns = 1'000'000'000;

}  // namespace

Stamp read_time(ByteCursor& in) {
  const std::int64_t s = in.u32(), ns = in.u32();
  return from_ns(s * second_ns + ns);
}

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

bool learn(const Header& header, std::span<const std::byte> data, KnownChannels& known) {
  Header fields;
  if (!header.connection || !read_fields(data, fields)) return false;
  known.channels.try_emplace(*header.connection, Channel{std::string(header.topic), std::string(fields.type),
                                                         MessageEncoding::ros1, std::string(fields.definition)});
  return true;
}

Found head_at(ByteWindow& bytes, std::uint64_t at, Record& out) {
  const auto before = bytes.at(at, 4);
  if (before.empty()) return Found::cut_off;
  const std::uint32_t header_size = ByteCursor(before).u32();
  if (header_size > most_header_bytes) return Found::broken;
  const auto all = bytes.at(at, 8ULL + header_size);  // one look: the next would take this one away
  if (all.empty()) return Found::cut_off;
  out.header = {};
  out.header_bytes = all.subspan(4, header_size);
  if (!read_fields(out.header_bytes, out.header)) return Found::broken;
  out.data_at = at + 8 + header_size;
  out.data_size = ByteCursor(all.subspan(4ULL + header_size)).u32();
  return Found::record;
}

}  // namespace takt::ros1
