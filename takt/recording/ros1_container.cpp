// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_container.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "takt/error.h"
#include "takt/recording/byte_cursor.h"
#include "takt/recording/ros1_records.h"

namespace takt {

using namespace ros1;

namespace {

constexpr std::uint32_t most_ahead_bytes = 1U << 25;  // larger chunks are read one at a time

/// What one visit carries along.
struct Visit {
  const Wants& wants;
  const std::function<void(const Message&)>& see;
  Connections connections;
  std::map<std::uint32_t, std::uint64_t> wanted;  // bytes by connection, once asked

  std::uint64_t bytes_of(std::uint32_t connection, const Channel& channel) {
    const auto [found, is_new] = wanted.try_emplace(connection, 0);
    if (is_new) found->second = wants(channel);
    return found->second;
  }
};

/// The records of a chunk, or false where they are broken; those before the break have been seen.
/// `place` says where a message is: in a chunk, or in the file where the chunk is not compressed.
template <class Place>
bool visit_records(ByteWindow records, Visit& visit, Place place) {
  const auto number = [&](std::uint64_t at) { return ByteCursor(records.at(at, 4)); };
  for (std::uint64_t at = 0; at < records.size();) {
    Header header;
    ByteCursor size = number(at);
    const std::uint32_t header_size = size.u32();
    if (!size.good() || !read_fields(records.at(at + 4, header_size), header)) return false;
    const std::string topic(header.op == Op::connection ? header.topic : "");
    header.topic = topic;
    size = number(at + 4 + header_size);
    const std::uint64_t data_at = at + 8 + header_size;
    const std::uint32_t data_size = size.u32();
    if (!size.good() || data_at + data_size > records.size()) return false;
    at = data_at + data_size;
    if (header.op == Op::connection && !learn_connection(header, records.at(data_at, data_size), visit.connections))
      return false;
    if (header.op != Op::message) continue;
    const auto found = header.connection ? visit.connections.find(*header.connection) : visit.connections.end();
    if (found == visit.connections.end()) return false;
    const std::uint64_t wanted = visit.bytes_of(found->first, found->second);
    if (wanted == 0) continue;
    const auto head = records.at(data_at, std::min<std::uint64_t>(wanted, data_size));
    visit.see({found->second, place(data_at, data_size), header.time.value_or(Stamp{}), head});
  }
  return true;
}

}  // namespace

bool is_ros1_bag(std::string_view head) {
  return head.starts_with(magic);
}

Ros1Container::Ros1Container(std::shared_ptr<const ByteSource> bytes, const std::string& where)
    : bytes_(std::move(bytes)) {
  std::array<std::byte, magic.size()> head{};
  const bool long_enough = bytes_->read(0, head);
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (!long_enough || !is_ros1_bag(text)) {
    const bool older = text.starts_with("#ROSBAG") || text.starts_with("#ROSRECORD");
    throw Error(older ? "is a bag of another version than 2.0" : "is no ROS 1 bag", where,
                older ? "convert it with `rosbag fix`" : "check that the copy is complete");
  }
}

std::vector<std::string> Ros1Container::visit(const Wants& wants,
                                              const std::function<void(const Message&)>& see) const {
  std::vector<std::string> notes;
  Visit visit{wants, see, {}, {}};
  const std::optional<Index> index = read_index(*bytes_);
  if (index) visit.connections = index->connections;
  const auto is_wanted = [&](std::uint64_t chunk) {
    if (!index || !index->chunks.contains(chunk)) return true;
    const auto& inside = index->chunks.at(chunk);
    return std::any_of(inside.begin(), inside.end(), [&](std::uint32_t id) {
      const auto channel = visit.connections.find(id);
      return channel == visit.connections.end() || visit.bytes_of(id, channel->second) > 0;
    });
  };

  const auto load = [&](std::uint64_t place, ChunkBuffer& into) {
    Record chunk;
    return read_record(*bytes_, place, chunk) == Found::record && load_chunk(*bytes_, chunk, into);
  };
  const auto next_chunk = [&](std::uint64_t place) -> std::uint64_t {
    constexpr int most_records = 4096;  // a look ahead, not a search
    Record r;
    Found found = read_record(*bytes_, place, r);
    for (int i = 0; found == Found::record && i < most_records; ++i) {
      place = r.end();
      found = read_record(*bytes_, place, r);
      if (found != Found::record || r.header.op != Op::chunk || !is_wanted(place)) continue;
      const bool fits = r.header.compression != "none" && r.header.size.value_or(0) <= most_ahead_bytes;
      return fits ? place : 0;
    }
    return 0;
  };
  ChunkAhead chunks(load, next_chunk);

  Record record;
  std::uint64_t zeros = 0;  // crashed recorders leave zero-filled tails
  std::uint64_t broken_chunks = 0;
  for (std::uint64_t at = magic.size(); at < bytes_->size(); at = record.end()) {
    const Found found = read_record(*bytes_, at, record);
    if (found == Found::record && record.header_bytes.empty() && record.data_size == 0) {
      const std::uint64_t next = after_zeros(*bytes_, at);
      zeros += next - at;
      record.data_at = next;
      continue;
    }
    const auto in_chunk = [at](std::uint64_t offset, std::uint32_t size) { return MessagePlace{at, offset, size}; };
    const auto in_file = [&](std::uint64_t offset, std::uint32_t size) {
      return MessagePlace{std::nullopt, record.data_at + offset, size};
    };
    if (found != Found::record) {
      if (found == Found::cut_off && record.header.op == Op::chunk) {
        if (record.header.compression == "none")
          visit_records(ByteWindow(*bytes_, record.data_at, bytes_->size()), visit, in_file);
        else
          visit_records(ByteWindow(read_part_of_chunk(*bytes_, record)), visit, in_chunk);
      }
      notes.push_back(
          fmt::format("byte {}: {}; what was before it was read", at,
                      found == Found::cut_off ? "the file is cut off in a record" : "the record is broken"));
      break;
    }
    if (record.header.op == Op::connection) {
      const auto data = read_data(*bytes_, record);
      if (data) learn_connection(record.header, *data, visit.connections);
    }
    if (record.header.op == Op::chunk && is_wanted(at)) {
      bool good = false;
      if (record.header.compression == "none") {
        good = record.header.size == record.data_size &&
               visit_records(ByteWindow(*bytes_, record.data_at, record.end()), visit, in_file);
      } else if (const ChunkBuffer* const chunk = chunks.at(at)) {
        good = visit_records(ByteWindow(chunk->records()), visit, in_chunk);
      }
      if (!good) ++broken_chunks;
    }
    if (record.header.op == Op::message && record.header.connection) {
      const auto known = visit.connections.find(*record.header.connection);
      if (known == visit.connections.end()) continue;
      const std::uint64_t wanted =
          std::min<std::uint64_t>(visit.bytes_of(known->first, known->second), record.data_size);
      Bytes head(static_cast<std::size_t>(wanted));
      if (wanted > 0 && bytes_->read(record.data_at, head))
        see({known->second, in_file(0, record.data_size), record.header.time.value_or(Stamp{}), head});
    }
  }
  if (broken_chunks > 0) notes.push_back(fmt::format("{} chunks are broken and were passed over", broken_chunks));
  if (zeros > 0) notes.push_back(fmt::format("{} zero bytes between records were passed over", zeros));
  return notes;
}

std::vector<Channel> Ros1Container::channels() const {
  std::vector<Channel> out;
  if (const auto index = read_index(*bytes_)) {
    for (const auto& [id, channel] : index->connections) out.push_back(channel);
    return out;
  }
  const auto none = [&](const Channel& c) {
    out.push_back(c);
    return std::uint64_t{0};
  };
  static_cast<void>(visit(none, [](const Message&) {}));
  return out;
}

std::shared_ptr<const MessageFile::Bytes> Ros1Container::chunk(std::uint64_t place) const {
  Record record;
  const Found found = read_record(*bytes_, place, record);
  if (found == Found::broken || record.header.op != Op::chunk) return nullptr;
  if (found == Found::cut_off) return std::make_shared<const Bytes>(read_part_of_chunk(*bytes_, record));
  auto records = read_chunk(*bytes_, record);
  if (!records) return nullptr;
  return std::make_shared<const Bytes>(std::move(*records));
}

std::shared_ptr<const MessageFile::Bytes> Ros1Container::message(const MessagePlace& place) const {
  if (place.offset > bytes_->size() || place.size > bytes_->size() - place.offset) return nullptr;
  auto data = std::make_shared<Bytes>(place.size);
  return bytes_->read(place.offset, *data) ? data : nullptr;
}

}  // namespace takt
