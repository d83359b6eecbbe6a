// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_restamp.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>

#include "takt/error.h"
#include "takt/recording/byte_cursor.h"
#include "takt/recording/output_file.h"
#include "takt/recording/ros1_container.h"
#include "takt/recording/ros1_records.h"

namespace takt {

using namespace ros1;

namespace {

using Bytes = std::vector<std::byte>;

template <class T>
void put_number(std::span<std::byte> out, T value) {
  std::memcpy(out.data(), &value, sizeof value);
}
template <class T>
std::span<const std::byte> bytes_of(const T& value) {
  return std::as_bytes(std::span(&value, 1));
}

/// What became of a chunk, for the index.
struct MovedChunk {
  std::uint64_t now_at = 0;
  std::optional<Stamp> start, end;  // of its record times
  bool times_moved = false;
};

class Rewriter {
 public:
  Rewriter(const std::string& in, const std::string& out, const Restamping& order)
      : where_(in), file_(open_bytes(in)), bag_(file_, in), out_(out), order_(order) {
    topics_ = topics_to_restamp(bag_.channels(), order.stream, in, result_.notes);
  }

  Restamped run() {
    out_.copy(*file_, 0, magic.size());
    for (std::uint64_t at = magic.size(); at < file_->size(); at = record_.end()) {
      const Found found = read_record(*file_, at, record_);
      if (found == Found::record && record_.header_bytes.empty() && record_.data_size == 0) {
        record_.data_at = after_zeros(*file_, at);
        out_.copy(*file_, at, record_.data_at - at);
        continue;
      }
      if (found != Found::record) {
        result_.notes.push_back(
            fmt::format("byte {}: the bag is cut off or broken here; the {} bytes from there on are left out", at,
                        file_->size() - at));
        break;
      }
      copy_record(at);
    }
    // The places of the index are known only now.
    if (bag_header_ && bag_header_->place && *bag_header_->place > 0) {
      const auto moved = moved_records_.find(*bag_header_->place);
      const std::uint64_t index_at = moved != moved_records_.end() ? moved->second : 0;
      if (index_at != *bag_header_->place) out_.patch(bag_header_place_, bytes_of(index_at));
      if (index_at == 0) result_.notes.push_back("its index is lost: run `rosbag reindex` on the copy");
    }
    if (broken_ > 0)
      result_.notes.push_back(fmt::format("{} broken chunks or messages were copied as they are", broken_));
    out_.finish();
    result_.streams = log_.streams();
    return std::move(result_);
  }

 private:
  void copy_record(std::uint64_t at) {
    const std::uint64_t now_at = out_.place();
    switch (record_.header.op) {
      case Op::bag:
        bag_header_ = record_.header;
        bag_header_place_ = now_at + 4 + record_.header.place_at;
        break;
      case Op::connection:
        note_index(at, now_at);
        if (const auto data = read_data(*file_, record_)) learn_connection(record_.header, *data, connections_);
        break;
      case Op::chunk: {
        chunk_ = &chunks_[at];
        chunk_->now_at = now_at;
        new_times_.clear();
        if (copy_chunk()) return;
        break;
      }
      case Op::index:
        if (new_times_.empty()) break;
        copy_index_data();
        return;
      case Op::chunk_info:
        note_index(at, now_at);
        copy_chunk_info();
        return;
      case Op::message:
        copy_bare_message();
        return;
      case Op::none:
        break;
    }
    out_.copy(*file_, at, record_.end() - at);
  }

  /// The index begins with a connection's or a chunk's record.
  void note_index(std::uint64_t at, std::uint64_t now_at) {
    if (bag_header_ && bag_header_->place == at) moved_records_[at] = now_at;
  }

  [[nodiscard]] bool is_wanted(const std::optional<std::uint32_t>& connection) const {
    const auto found = connection ? connections_.find(*connection) : connections_.end();
    return found != connections_.end() && topics_.contains(found->second.topic);
  }

  /// False where nothing in it changes: it is copied as it is.
  bool copy_chunk() {
    auto records = read_chunk(*file_, record_);
    if (!records) {
      ++broken_;
      return false;
    }
    const bool changed = restamp_records(*records);
    if (!changed) return false;
    const auto data = compress(*compression_named(record_.header.compression), *records);
    write_record(record_.header_bytes, data);
    return true;
  }

  void write_record(std::span<const std::byte> header, std::span<const std::byte> data) {
    out_.write(bytes_of(static_cast<std::uint32_t>(header.size())));
    out_.write(header);
    out_.write(bytes_of(static_cast<std::uint32_t>(data.size())));
    out_.write(data);
  }

  bool restamp_records(Bytes& records) {
    bool changed = false;
    ByteCursor in(records);
    while (in.left() > 0) {
      const std::size_t record_at = in.place();
      Header header;
      const auto fields = in.bytes(in.u32());
      const std::size_t header_at = in.place() - fields.size();
      const auto data = in.bytes(in.u32());
      if (!in.good() || !read_fields(fields, header)) {
        ++broken_;
        break;
      }
      if (header.op == Op::connection) learn_connection(header, data, connections_);
      if (header.op != Op::message) continue;
      Stamp recorded = header.time.value_or(Stamp{});
      if (is_wanted(header.connection)) {
        const auto message = std::span(records).subspan(in.place() - data.size(), data.size());
        const Stamp now = restamp(header, message, std::span(records).subspan(header_at, fields.size()), changed);
        if (now != recorded) new_times_[{*header.connection, static_cast<std::uint32_t>(record_at)}] = recorded = now;
      }
      chunk_->start = std::min(chunk_->start.value_or(recorded), recorded);
      chunk_->end = std::max(chunk_->end.value_or(recorded), recorded);
    }
    chunk_->times_moved = !new_times_.empty();
    return changed;
  }

  /// Exchanges the stamp, and the record's time where that is asked; gives the latter.
  Stamp restamp(const Header& header, std::span<std::byte> message, std::span<std::byte> fields, bool& changed) {
    const Stamp recorded = header.time.value_or(Stamp{});
    const auto done = restamp_message(MessageEncoding::ros1, message, order_, where_);
    if (!done) {
      ++broken_;
      return recorded;
    }
    log_.saw(connections_.at(*header.connection).topic, done->before, done->after);
    if (done->after == done->before) return recorded;
    changed = true;
    if (!order_.record_time || !header.time) return recorded;
    const Stamp now = recorded + (done->after - done->before);
    if (!put_time(fields.subspan(header.time_at), now))
      throw Error(fmt::format("record time {} ns cannot become {} ns", to_ns(recorded), to_ns(now)), where_,
                  "leave --record-time away");
    return now;
  }

  /// `time, offset` for every message of one connection in the chunk before.
  void copy_index_data() {
    auto data = read_data(*file_, record_);
    if (!data) return;
    const std::uint32_t connection = record_.header.connection.value_or(0);
    for (std::size_t i = 0; i + 12 <= data->size(); i += 12) {
      const std::uint32_t offset = ByteCursor(std::span(*data).subspan(i + 8, 4)).u32();
      const auto moved = new_times_.find({connection, offset});
      if (moved != new_times_.end() && !put_time(std::span(*data).subspan(i, 8), moved->second)) ++broken_;
    }
    write_record(record_.header_bytes, *data);
  }

  void copy_chunk_info() {
    Bytes header = record_.header_bytes;
    const auto moved = chunks_.find(record_.header.place.value_or(0));
    if (moved != chunks_.end() && record_.header.place) {
      const MovedChunk& chunk = moved->second;
      put_number(std::span(header).subspan(record_.header.place_at, 8), chunk.now_at);
      if (chunk.times_moved && record_.header.start_time && record_.header.end_time) {
        const bool fits = put_time(std::span(header).subspan(record_.header.start_time_at), *chunk.start) &&
                          put_time(std::span(header).subspan(record_.header.end_time_at), *chunk.end);
        if (!fits) ++broken_;
      }
    }
    out_.write(bytes_of(static_cast<std::uint32_t>(header.size())));
    out_.write(header);
    out_.copy(*file_, record_.data_at - 4, 4ULL + record_.data_size);
  }

  /// A message outside of chunks.
  void copy_bare_message() {
    auto data = read_data(*file_, record_);
    if (!data) return;
    Bytes header = record_.header_bytes;
    bool changed = false;
    if (is_wanted(record_.header.connection)) restamp(record_.header, *data, header, changed);
    write_record(header, *data);
  }

  std::string where_;
  std::shared_ptr<const ByteSource> file_;
  Ros1Container bag_;
  OutputFile out_;
  const Restamping& order_;
  std::set<std::string> topics_;
  Connections connections_;
  Record record_;
  std::optional<Header> bag_header_;  // its texts are not looked at
  std::uint64_t bag_header_place_ = 0;
  std::map<std::uint64_t, std::uint64_t> moved_records_;
  std::map<std::uint64_t, MovedChunk> chunks_;
  MovedChunk* chunk_ = nullptr;                                         // the one before
  std::map<std::pair<std::uint32_t, std::uint32_t>, Stamp> new_times_;  // in it, by connection and offset
  std::size_t broken_ = 0;
  RestampLog log_;
  Restamped result_;
};

}  // namespace

Restamped restamp_ros1_bag(const std::string& in, const std::string& out, const Restamping& order, const OpenOptions&) {
  return Rewriter(in, out, order).run();
}

}  // namespace takt
