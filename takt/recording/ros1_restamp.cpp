// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_bag.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "takt/error.h"
#include "takt/recording/byte_cursor.h"
#include "takt/recording/byte_edit.h"
#include "takt/recording/message_restamper.h"
#include "takt/recording/output_file.h"
#include "takt/recording/record_walk.h"
#include "takt/recording/ros1_container.h"
#include "takt/recording/ros1_records.h"

namespace takt {

using namespace ros1;

namespace {

using Bytes = std::vector<std::byte>;

/// What became of a chunk, for the index.
struct MovedChunk {
  std::uint64_t now_at = 0;
  std::optional<Stamp> start, end;  // of its record times
  bool times_moved = false;
};

class Rewriter {
 public:
  Rewriter(const std::string& in, const std::string& out, const Restamping& order)
      : where_(in),
        file_(open_bytes(in)),
        window_(*file_, 0, file_->size()),
        out_(out),
        restamper_(Ros1Container(file_, in).channels(), order, in) {}

  Restamped run() {
    out_.copy(*file_, 0, magic.size());
    RecordWalk walk(ros1_format(), window_, magic.size());
    while (const auto found = walk.next()) {
      const std::size_t broken = restamper_.broken();
      copy_record(*found);
      if (restamper_.broken() > broken) walk.doubt_last();
    }
    restamper_.left_out(walk.damage());
    if (walk.broke_off())
      restamper_.note(fmt::format("byte {}: the bag is cut off or broken here; the {} bytes from there on are left out",
                                  walk.place(), file_->size() - walk.place()));
    correct_bag_header();
    out_.finish();
    return restamper_.finish();
  }

 private:
  void copy_record(const FileRecord& found) {
    const std::uint64_t at = found.at, now_at = out_.place();
    if (found.kind == FileRecord::Kind::zeros || !read_record(found)) return out_.copy(*file_, at, found.end - at);
    switch (record_.header.op) {
      case Op::bag:
        index_at_ = record_.header.place.value_or(0);
        bag_header_place_ = now_at + 4 + record_.header.place_at;
        break;
      case Op::connection:
        note_index(at, now_at);
        static_cast<void>(learn(record_.header, data_of(found), known_));
        break;
      case Op::chunk: {
        chunk_ = &chunks_[at];
        chunk_->now_at = now_at;
        new_times_.clear();
        if (copy_chunk(found)) return;
        break;
      }
      case Op::index:
        if (new_times_.empty()) break;
        copy_index_data(data_of(found));
        return;
      case Op::chunk_info:
        note_index(at, now_at);
        copy_chunk_info();
        return;
      case Op::message:
        copy_bare_message(data_of(found));
        return;
      case Op::none:
        break;
    }
    out_.copy(*file_, at, found.end - at);
  }

  /// The header, in memory of its own.
  bool read_record(const FileRecord& found) {
    Record look;
    if (head_at(window_, found.at, look) != Found::record) return false;
    header_bytes_.assign(look.header_bytes.begin(), look.header_bytes.end());
    record_ = look;
    record_.header = {};
    record_.header_bytes = header_bytes_;
    return read_fields(record_.header_bytes, record_.header);
  }

  [[nodiscard]] Bytes data_of(const FileRecord& found) const {
    Bytes data(static_cast<std::size_t>(found.end - found.data_at));  // its size was checked against the file's
    if (!file_->read(found.data_at, data)) throw Error("broke off while being read", where_, "is the disk well?");
    return data;
  }

  /// The place of the index is known only now.
  void correct_bag_header() {
    if (index_at_ == 0) return;
    if (index_now_at_ != index_at_) out_.patch(bag_header_place_, bytes_of(index_now_at_));
    if (index_now_at_ == 0) restamper_.note("its index is lost: run `rosbag reindex` on the copy");
  }

  /// The index begins with a connection's or a chunk's record.
  void note_index(std::uint64_t at, std::uint64_t now_at) {
    if (index_at_ == at) index_now_at_ = now_at;
  }

  [[nodiscard]] bool is_wanted(const std::optional<std::uint32_t>& connection) const {
    const auto found = connection ? known_.channels.find(*connection) : known_.channels.end();
    return found != known_.channels.end() && restamper_.moves(found->second);
  }

  /// False where nothing in it changes: it is copied as it is.
  bool copy_chunk(const FileRecord& found) {
    if (!load_records(*file_, found.records, buffer_)) {
      restamper_.count_broken();
      return false;
    }
    const auto records = std::span(buffer_.plain).first(buffer_.size);
    if (!restamp_records(records)) return false;
    const auto data = compress(found.records.compression, records);
    write_record(record_.header_bytes, data);
    return true;
  }

  void write_record(std::span<const std::byte> header, std::span<const std::byte> data) {
    out_.write(bytes_of(static_cast<std::uint32_t>(header.size())));
    out_.write(header);
    out_.write(bytes_of(static_cast<std::uint32_t>(data.size())));
    out_.write(data);
  }

  bool restamp_records(std::span<std::byte> records) {
    bool changed = false;
    ByteWindow bytes(records);
    RecordWalk walk(ros1_format(), bytes, 0);
    while (const auto found = walk.next()) {
      Record inner;
      if (head_at(bytes, found->at, inner) != Found::record) continue;
      const Header& header = inner.header;
      const auto data = records.subspan(inner.data_at, inner.data_size);
      if (header.op == Op::connection) static_cast<void>(learn(header, data, known_));
      if (header.op != Op::message) continue;
      Stamp recorded = header.time.value_or(Stamp{});
      if (is_wanted(header.connection)) {
        const auto fields = records.subspan(found->at + 4, inner.header_bytes.size());
        const Stamp now = restamp(header, data, fields, changed);
        if (now != recorded) new_times_[{*header.connection, static_cast<std::uint32_t>(found->at)}] = recorded = now;
      }
      chunk_->start = std::min(chunk_->start.value_or(recorded), recorded);
      chunk_->end = std::max(chunk_->end.value_or(recorded), recorded);
    }
    if (walk.broke_off() || walk.damage().places > 0) restamper_.count_broken();
    chunk_->times_moved = !new_times_.empty();
    return changed;
  }

  /// Exchanges the stamp, and the record's time where that is asked; gives the latter.
  Stamp restamp(const Header& header, std::span<std::byte> message, std::span<std::byte> fields, bool& changed) {
    const Stamp recorded = header.time.value_or(Stamp{});
    const auto done = restamper_.restamp(known_.channels.at(*header.connection), message);
    if (!done) return recorded;
    changed = true;
    if (!restamper_.moves_record_time() || !header.time) return recorded;
    const Stamp now = recorded + done->moved_by();
    if (!put_time(fields.subspan(header.time_at), now))
      throw Error(fmt::format("record time {} ns cannot become {} ns", to_ns(recorded), to_ns(now)), where_,
                  "leave --record-time away");
    return now;
  }

  /// `time, offset` for every message of one connection in the chunk before.
  void copy_index_data(Bytes data) {
    const std::uint32_t connection = record_.header.connection.value_or(0);
    for (std::size_t i = 0; i + 12 <= data.size(); i += 12) {
      const std::uint32_t offset = ByteCursor(std::span(data).subspan(i + 8, 4)).u32();
      const auto moved = new_times_.find({connection, offset});
      if (moved != new_times_.end() && !put_time(std::span(data).subspan(i, 8), moved->second))
        restamper_.count_broken();
    }
    write_record(record_.header_bytes, data);
  }

  void copy_chunk_info() {
    Bytes header = header_bytes_;
    const auto moved = chunks_.find(record_.header.place.value_or(0));
    if (moved != chunks_.end() && record_.header.place) {
      const MovedChunk& chunk = moved->second;
      put_number(std::span(header), record_.header.place_at, chunk.now_at);
      if (chunk.times_moved && record_.header.start_time && record_.header.end_time) {
        const bool fits = put_time(std::span(header).subspan(record_.header.start_time_at), *chunk.start) &&
                          put_time(std::span(header).subspan(record_.header.end_time_at), *chunk.end);
        if (!fits) restamper_.count_broken();
      }
    }
    out_.write(bytes_of(static_cast<std::uint32_t>(header.size())));
    out_.write(header);
    out_.copy(*file_, record_.data_at - 4, 4ULL + record_.data_size);
  }

  /// A message outside of chunks.
  void copy_bare_message(Bytes data) {
    Bytes header = header_bytes_;
    bool changed = false;
    if (is_wanted(record_.header.connection)) restamp(record_.header, data, header, changed);
    write_record(header, data);
  }

  std::string where_;
  std::shared_ptr<const ByteSource> file_;
  ByteWindow window_;
  OutputFile out_;
  MessageRestamper restamper_;
  KnownChannels known_;
  ChunkBuffer buffer_;
  Record record_;  // the one that is copied
  Bytes header_bytes_;
  std::uint64_t bag_header_place_ = 0, index_at_ = 0, index_now_at_ = 0;
  std::map<std::uint64_t, MovedChunk> chunks_;
  MovedChunk* chunk_ = nullptr;                                         // the one before
  std::map<std::pair<std::uint32_t, std::uint32_t>, Stamp> new_times_;  // in it, by connection and offset
};

}  // namespace

Restamped restamp_ros1_bag(const std::string& in, const std::string& out, const Restamping& order, const OpenOptions&) {
  return Rewriter(in, out, order).run();
}

}  // namespace takt
