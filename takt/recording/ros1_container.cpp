// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_container.h"

#include <fmt/core.h>

#include <algorithm>

#include "takt/error.h"
#include "takt/recording/byte_cursor.h"
#include "takt/recording/decompress.h"

namespace takt {

namespace {

constexpr std::string_view magic = "#ROSBAG V2.0\n";
constexpr std::uint32_t most_header_bytes = 1U << 20;
constexpr std::uint32_t most_chunk_bytes = 1U << 29;  // rosbag's own default is 768 kB

enum class Op : std::uint8_t { none = 0, message = 2, bag = 3, index = 4, chunk = 5, chunk_info = 6, connection = 7 };

/// The fields of a record header that matter here. A field that is absent stays empty.
struct Header {
  Op op = Op::none;
  std::optional<std::uint32_t> connection;
  std::optional<std::uint32_t> size;  ///< of a chunk, decompressed
  std::string_view topic, type, compression;
};

/// `name=value` fields, each after its length. False where they do not fill the bytes exactly.
bool read_fields(std::span<const std::byte> bytes, Header& header) {
  ByteCursor in(bytes);
  while (in.left() > 0) {
    const std::string_view field = in.text(in.u32());
    const std::size_t equals = field.find('=');
    if (!in.good() || equals == std::string_view::npos) return false;
    const std::string_view name = field.substr(0, equals), value = field.substr(equals + 1);
    ByteCursor number(std::as_bytes(std::span(value)));
    if (name == "op") header.op = static_cast<Op>(number.u8());
    if (name == "conn") header.connection = number.u32();
    if (name == "size") header.size = number.u32();
    if (name == "topic") header.topic = value;
    if (name == "type") header.type = value;
    if (name == "compression") header.compression = value;
    if (!number.good()) return false;
  }
  return true;
}

using Connections = std::map<std::uint32_t, Ros1Connection>;

/// A connection's type stands among the fields of its data. The first record of an id counts.
bool learn_connection(const Header& header, std::span<const std::byte> data, Connections& connections) {
  Header fields;
  if (!header.connection || !read_fields(data, fields)) return false;
  connections.try_emplace(*header.connection, Ros1Connection{std::string(header.topic), std::string(fields.type)});
  return true;
}

/// The records of a chunk, or false where they are broken; those before the break have been seen.
bool visit_chunk(std::span<const std::byte> records, std::uint64_t at, Connections& connections,
                 const std::function<void(const Ros1Message&)>& see) {
  ByteCursor in(records);
  while (in.left() > 0) {
    Header header;
    const auto fields = in.bytes(in.u32());
    const std::uint32_t size = in.u32();
    const std::uint64_t offset = in.place();
    const auto data = in.bytes(size);
    if (!in.good() || !read_fields(fields, header)) return false;
    if (header.op == Op::connection && !learn_connection(header, data, connections)) return false;
    if (header.op != Op::message) continue;
    const auto found = header.connection ? connections.find(*header.connection) : connections.end();
    if (found == connections.end()) return false;
    see({found->second, {at, offset, size}, data});
  }
  return true;
}

/// A record in the file: its header, and where its data is.
struct Record {
  Header header;
  std::vector<std::byte> header_bytes;  // what the header's views look at
  std::uint64_t data_at = 0;
  std::uint32_t data_size = 0;

  [[nodiscard]] std::uint64_t end() const { return data_at + data_size; }
};

std::optional<std::uint32_t> read_u32(const ByteSource& file, std::uint64_t at) {
  std::array<std::byte, 4> bytes{};
  if (!file.read(at, bytes)) return std::nullopt;
  return ByteCursor(bytes).u32();
}

/// The first byte from `at` on that is not zero, or the file's size. A record never starts with a zero byte, because
/// its header has a length.
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

enum class Found { record, cut_off, broken };

Found read_record(const ByteSource& file, std::uint64_t at, Record& out) {
  const auto header_size = read_u32(file, at);
  if (!header_size) return Found::cut_off;
  if (*header_size > most_header_bytes) return Found::broken;
  if (at + 8 + *header_size > file.size()) return Found::cut_off;
  out.header = {};
  out.header_bytes.resize(*header_size);
  if (!file.read(at + 4, out.header_bytes)) return Found::cut_off;
  if (!read_fields(out.header_bytes, out.header)) return Found::broken;
  const auto data_size = read_u32(file, at + 4 + *header_size);
  if (!data_size) return Found::cut_off;
  out.data_at = at + 8 + *header_size;
  out.data_size = *data_size;
  return out.end() > file.size() ? Found::cut_off : Found::record;
}

std::optional<std::vector<std::byte>> read_data(const ByteSource& file, const Record& record) {
  std::vector<std::byte> data(record.data_size);  // its size was checked against the file's
  if (!file.read(record.data_at, data)) return std::nullopt;
  return data;
}

std::optional<std::vector<std::byte>> read_chunk(const ByteSource& file, const Record& record) {
  const std::uint32_t size = record.header.size.value_or(0);
  if (!record.header.size || size > most_chunk_bytes || record.data_size > most_chunk_bytes) return std::nullopt;
  auto data = read_data(file, record);
  if (!data) return std::nullopt;
  if (record.header.compression == "bz2") return decompress_bz2(*data, size);
  if (record.header.compression == "lz4") return decompress_lz4(*data, size);
  if (record.header.compression != "none" || data->size() != size) return std::nullopt;
  return data;
}

}  // namespace

bool is_ros1_bag(std::string_view head) {
  return head.starts_with(magic);
}

Ros1Container::Ros1Container(std::shared_ptr<const ByteSource> bytes, std::string where)
    : bytes_(std::move(bytes)), where_(std::move(where)) {
  std::array<std::byte, magic.size()> head{};
  const bool long_enough = bytes_->read(0, head);
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (!long_enough || !is_ros1_bag(text)) {
    const bool older = text.starts_with("#ROSBAG") || text.starts_with("#ROSRECORD");
    throw Error(older ? "is a bag of another version than 2.0" : "is no ROS 1 bag", where_,
                older ? "convert it with `rosbag fix`" : "check that the copy is complete");
  }
}

std::vector<std::string> Ros1Container::visit(const std::function<void(const Ros1Message&)>& see) const {
  std::vector<std::string> notes;
  Connections connections;
  Record record;
  std::uint64_t zeros = 0;  // crashed recorders leave zero-filled tails
  std::uint64_t broken_chunks = 0;
  for (std::uint64_t at = magic.size(); at < bytes_->size();) {
    const Found found = read_record(*bytes_, at, record);
    if (found == Found::record && record.header_bytes.empty() && record.data_size == 0) {
      const std::uint64_t next = after_zeros(*bytes_, at);
      zeros += next - at;
      at = next;
      continue;
    }
    if (found != Found::record) {
      notes.push_back(
          fmt::format("byte {}: {}; what was before it was read", at,
                      found == Found::cut_off ? "the file is cut off in a record" : "the record is broken"));
      break;
    }
    if (record.header.op == Op::connection) {
      const auto data = read_data(*bytes_, record);
      if (data) learn_connection(record.header, *data, connections);
    }
    if (record.header.op == Op::chunk) {
      const auto records = read_chunk(*bytes_, record);
      if (!records || !visit_chunk(*records, at, connections, see)) ++broken_chunks;
    }
    if (record.header.op == Op::message && record.header.connection) {
      const auto known = connections.find(*record.header.connection);
      const auto data = known != connections.end() ? read_data(*bytes_, record) : std::nullopt;
      if (data) see({known->second, {std::nullopt, record.data_at, record.data_size}, *data});
    }
    at = record.end();
  }
  if (broken_chunks > 0) notes.push_back(fmt::format("{} chunks are broken and were passed over", broken_chunks));
  if (zeros > 0) notes.push_back(fmt::format("{} zero bytes between records were passed over", zeros));
  return notes;
}

std::shared_ptr<const std::vector<std::byte>> Ros1Container::chunk(std::uint64_t offset) const {
  Record record;
  if (read_record(*bytes_, offset, record) != Found::record || record.header.op != Op::chunk) return nullptr;
  auto records = read_chunk(*bytes_, record);
  if (!records) return nullptr;
  return std::make_shared<const std::vector<std::byte>>(std::move(*records));
}

}  // namespace takt
