// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <unordered_map>

#include "takt/error.h"
#include "takt/recording/byte_edit.h"
#include "takt/recording/mcap.h"
#include "takt/recording/mcap_container.h"
#include "takt/recording/mcap_records.h"
#include "takt/recording/message_restamper.h"
#include "takt/recording/output_file.h"
#include "takt/recording/record_walk.h"

namespace takt {

using namespace mcap;

namespace {

using Bytes = std::vector<std::byte>;

constexpr std::uint64_t most_content_bytes = 1ULL << 30;

/// What became of a chunk, for the index.
struct MovedChunk {
  std::uint64_t length = 0, compressed_size = 0, uncompressed_size = 0;
  std::uint64_t start_time = 0, end_time = 0;
};

/// A message of the chunk before, where its place or its record time is another now.
struct MovedMessage {
  std::uint64_t offset, log_time;
};

class Rewriter {
 public:
  Rewriter(const std::string& in, const std::string& out, const Restamping& order)
      : where_(in),
        file_(open_bytes(in)),
        window_(*file_, 0, file_->size()),
        out_(out),
        restamper_(McapContainer(file_, in).channels(), order, in) {}

  Restamped run() {
    out_.start_crc();
    out_.copy(*file_, 0, magic.size());
    RecordWalk walk(mcap_format(), window_, magic.size());
    bool in_summary = false, closed = false;
    while (!closed) {
      const auto found = walk.next();
      if (!found) break;
      const Record record = *head_at(window_, found->at);
      if (record.op != Op::message) moved_[record.at] = out_.place();
      if (record.op == Op::footer) {
        copy_footer(record);
        closed = true;
      } else if (in_summary) {
        copy_summary_record(record);
      } else {
        if (!copy_data_record(record)) walk.doubt_last();
      }
      if (record.op == Op::data_end) {
        in_summary = true;
        out_.start_crc();
      }
    }
    if (closed)
      out_.write(std::as_bytes(std::span(magic)));
    else if (walk.broke_off())
      restamper_.note(fmt::format("byte {}: the file is cut off here; the {} bytes from there on are left out",
                                  walk.place(), file_->size() - walk.place()));
    restamper_.left_out(walk.damage());
    out_.finish();
    return restamper_.finish();
  }

 private:
  void copy_raw(const Record& record) { out_.copy(*file_, record.at, record.end() - record.at); }

  void write_record(Op op, std::span<const std::byte> content) {
    Bytes head;
    append(head, static_cast<std::uint8_t>(op));
    append(head, static_cast<std::uint64_t>(content.size()));
    out_.write(head);
    out_.write(content);
  }

  std::optional<Bytes> content_of(const Record& record) {
    if (record.size > most_content_bytes) return std::nullopt;
    Bytes content(static_cast<std::size_t>(record.size));
    if (!file_->read(record.content_at(), content)) return std::nullopt;
    return content;
  }

  /// False where the record is broken.
  bool copy_data_record(const Record& record) {
    const std::size_t broken = restamper_.broken();
    if (!rewrite_data_record(record)) copy_raw(record);
    return restamper_.broken() == broken;
  }

  /// False where nothing changes in it: it is to be copied as it is.
  bool rewrite_data_record(const Record& record) {
    switch (record.op) {
      case Op::chunk:
        moved_messages_.clear();
        return rewrite_chunk(record);
      case Op::message_index:
        return !moved_messages_.empty() && rewrite_message_index(record);
      case Op::schema:
      case Op::channel:
        if (const auto content = content_of(record)) static_cast<void>(learn(record.op, *content, known_));
        return false;
      case Op::message:
        return rewrite_message(record);
      case Op::data_end: {
        auto content = content_of(record);
        if (!content || number_at<std::uint32_t>(*content, 0) == 0) return false;
        put_number(std::span(*content), 0, out_.crc());
        write_record(record.op, *content);
        return true;
      }
      default:
        return false;
    }
  }

  /// The channel of a message that is to be restamped.
  const Channel* wanted(std::span<const std::byte> message) const {
    if (message.size() < message_head) return nullptr;
    const auto found = known_.channels.find(number_at<std::uint16_t>(message, 0));
    return found != known_.channels.end() && restamper_.moves(found->second) ? &found->second : nullptr;
  }

  /// Exchanges the stamp and, where that is asked, the record times; the message may change its length.
  bool restamp(Bytes& message, const Channel& channel) {
    const auto done = restamper_.restamp(channel, std::span(message).subspan(message_head));
    if (!done) return false;
    if (done->longer) {
      message.resize(message_head);
      append(message, *done->longer);
    }
    if (restamper_.moves_record_time())
      for (const std::size_t at : {std::size_t{6}, std::size_t{14}}) {
        const auto moved = static_cast<std::int64_t>(number_at<std::uint64_t>(message, at)) + done->moved_by().count();
        if (moved < 0) throw Error("a record time would become negative", where_, "leave --record-time away");
        put_number(std::span(message), at, static_cast<std::uint64_t>(moved));
      }
    return true;
  }

  bool rewrite_message(const Record& record) {
    auto content = content_of(record);
    const Channel* const channel = content ? wanted(*content) : nullptr;
    const bool changed = channel && restamp(*content, *channel);
    if (content && content->size() >= message_head) see_time(number_at<std::uint64_t>(*content, 6));
    if (!changed) return false;
    write_record(record.op, *content);
    return true;
  }

  void see_time(std::uint64_t log_time) {
    earliest_ = std::min(earliest_, log_time);
    latest_ = std::max(latest_, log_time);
  }

  /// The reader takes records that are not compressed without looking at their checksum: so they are restamped, too.
  bool load(StoredRecords records) {
    if (records.compression == Compression::none) records.crc = 0;
    return load_records(*file_, records, chunk_);
  }
  /// A checksum that was wrong stays wrong.
  [[nodiscard]] std::uint32_t crc_after(const StoredRecords& before, const Bytes& now) const {
    const bool good = before.crc != 0 && crc32_of(chunk_.records()) == before.crc;
    return good ? crc32_of(now) : before.crc;
  }

  bool rewrite_chunk(const Record& record) {
    const auto head = chunk_head(window_, record);
    if (!head || !load(head->records)) {
      restamper_.count_broken();
      return false;
    }
    Bytes now;
    now.reserve(chunk_.size + 1024);
    MovedChunk moved{0, 0, 0, UINT64_MAX, 0};
    bool changed = false;
    ByteWindow bytes(chunk_.records());
    RecordWalk walk(mcap_format(), bytes, 0);
    std::uint64_t copied = 0;
    const auto copy_until = [&](std::uint64_t end) {  // what no record covers
      if (end > copied) append(now, bytes.at(copied, end - copied));
    };
    while (const auto found = walk.next()) {
      copy_until(found->at);
      copied = found->end;
      const auto inner = head_at(bytes, found->at);
      const auto content = bytes.at(inner->content_at(), inner->size);
      if (inner->op == Op::schema || inner->op == Op::channel) static_cast<void>(learn(inner->op, content, known_));
      const Channel* const channel = inner->op == Op::message ? wanted(content) : nullptr;
      std::uint64_t log_time = inner->op == Op::message ? number_at<std::uint64_t>(content, 6) : 0;
      if (!channel) {
        append(now, bytes.at(inner->at, inner->end() - inner->at));
      } else {
        Bytes message(content.begin(), content.end());
        const std::uint64_t old_time = log_time;
        changed = restamp(message, *channel) || changed;
        log_time = number_at<std::uint64_t>(message, 6);
        if (log_time != old_time || now.size() != inner->at) moved_messages_[inner->at] = {now.size(), log_time};
        append(now, static_cast<std::uint8_t>(inner->op));
        append(now, static_cast<std::uint64_t>(message.size()));
        append(now, message);
      }
      if (inner->op != Op::message) continue;
      if (!channel && now.size() != inner->end())
        moved_messages_[inner->at] = {now.size() - (inner->end() - inner->at), log_time};
      moved.start_time = std::min(moved.start_time, log_time);
      moved.end_time = std::max(moved.end_time, log_time);
    }
    copy_until(bytes.size());
    if (walk.broke_off() || walk.damage().places > 0) restamper_.count_broken();
    if (moved.start_time <= moved.end_time) {
      see_time(moved.start_time);
      see_time(moved.end_time);
    }
    if (!changed) return false;
    if (!restamper_.moves_record_time()) moved.start_time = head->start_time, moved.end_time = head->end_time;

    const Bytes data = compress(head->records.compression, now);
    Bytes content;
    append(content, moved.start_time);
    append(content, moved.end_time);
    append(content, static_cast<std::uint64_t>(now.size()));
    append(content, crc_after(head->records, now));
    append_text(content, head->compression);
    append(content, static_cast<std::uint64_t>(data.size()));
    append(content, data);
    moved.length = record_head + content.size();
    moved.compressed_size = data.size();
    moved.uncompressed_size = now.size();
    chunks_[record.at] = moved;
    write_record(record.op, content);
    return true;
  }

  bool rewrite_message_index(const Record& record) {
    auto content = content_of(record);
    if (!content) return false;
    for (std::size_t at = 6; at + 16 <= content->size(); at += 16) {
      const auto moved = moved_messages_.find(number_at<std::uint64_t>(*content, at + 8));
      if (moved == moved_messages_.end()) continue;
      put_number(std::span(*content), at, moved->second.log_time);
      put_number(std::span(*content), at + 8, moved->second.offset);
    }
    write_record(record.op, *content);
    return true;
  }

  [[nodiscard]] std::uint64_t now_at(std::uint64_t place) const {
    const auto moved = moved_.find(place);
    return moved == moved_.end() ? place : moved->second;
  }

  /// What the summary says of places and sizes is corrected where it stands: no record changes its length.
  void copy_summary_record(const Record& record) {
    auto content = content_of(record);
    if (!content) return copy_raw(record);
    const std::span<std::byte> bytes(*content);
    if (record.op == Op::chunk_index) correct_chunk_index(bytes);
    if (record.op == Op::attachment_index || record.op == Op::metadata_index)
      put_number(bytes, 0, now_at(number_at<std::uint64_t>(bytes, 0)));
    if (record.op == Op::statistics && restamper_.moves_record_time() && earliest_ <= latest_) {
      constexpr std::size_t times_at = 8 + 2 + 4 + 4 + 4 + 4;
      put_number(bytes, times_at, earliest_);
      put_number(bytes, times_at + 8, latest_);
    }
    if (record.op == Op::summary_offset) put_number(bytes, 1, now_at(number_at<std::uint64_t>(bytes, 1)));
    write_record(record.op, *content);
  }

  void correct_chunk_index(std::span<std::byte> bytes) {
    const auto chunk_at = number_at<std::uint64_t>(bytes, 16);
    put_number(bytes, 16, now_at(chunk_at));
    const std::uint64_t map_size = number_at<std::uint32_t>(bytes, 32);
    for (std::uint64_t at = 36; at + 10 <= 36 + map_size && at + 10 <= bytes.size(); at += 10)
      put_number(bytes, static_cast<std::size_t>(at + 2),
                 now_at(number_at<std::uint64_t>(bytes, static_cast<std::size_t>(at + 2))));
    const auto moved = chunks_.find(chunk_at);
    if (moved == chunks_.end() || bytes.size() < 16) return;
    put_number(bytes, 0, moved->second.start_time);
    put_number(bytes, 8, moved->second.end_time);
    put_number(bytes, 24, moved->second.length);
    put_number(bytes, bytes.size() - 16, moved->second.compressed_size);
    put_number(bytes, bytes.size() - 8, moved->second.uncompressed_size);
  }

  void copy_footer(const Record& record) {
    auto content = content_of(record);
    if (!content || content->size() < 20) return copy_raw(record);
    const std::span<std::byte> bytes(*content);
    for (const std::size_t at : {std::size_t{0}, std::size_t{8}})
      if (const auto place = number_at<std::uint64_t>(bytes, at); place != 0) put_number(bytes, at, now_at(place));
    Bytes head;
    append(head, static_cast<std::uint8_t>(record.op));
    append(head, record.size);
    append(head, std::span<const std::byte>(bytes).first(16));
    out_.write(head);
    if (number_at<std::uint32_t>(bytes, 16) != 0) put_number(bytes, 16, out_.crc());
    out_.write(std::span<const std::byte>(bytes).subspan(16));
  }

  std::string where_;
  std::shared_ptr<const ByteSource> file_;
  ByteWindow window_;
  OutputFile out_;
  MessageRestamper restamper_;
  KnownChannels known_;
  ChunkBuffer chunk_;
  std::unordered_map<std::uint64_t, std::uint64_t> moved_;  // where records began, and begin now
  std::map<std::uint64_t, MovedChunk> chunks_;
  std::unordered_map<std::uint64_t, MovedMessage> moved_messages_;  // of the chunk before
  std::uint64_t earliest_ = UINT64_MAX, latest_ = 0;
};

}  // namespace

Restamped restamp_mcap(const std::string& in, const std::string& out, const Restamping& order, const OpenOptions&) {
  return Rewriter(in, out, order).run();
}

}  // namespace takt
