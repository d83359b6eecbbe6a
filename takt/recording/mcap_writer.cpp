// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "takt/recording/byte_edit.h"
#include "takt/recording/mcap_records.h"
#include "takt/recording/message_writer.h"
#include "takt/recording/output_file.h"
#include "takt/recording/write_messages.h"
#include "takt/version.h"

namespace takt {

using namespace mcap;

namespace {

using Bytes = std::vector<std::byte>;
constexpr std::size_t chunk_bytes = 1U << 20;
constexpr const char* compression = "zstd";

void append_record(Bytes& out, Op op, std::span<const std::byte> content) {
  append(out, static_cast<std::uint8_t>(op));
  append(out, static_cast<std::uint64_t>(content.size()));
  append(out, content);
}

class McapWriter : public MessageSink {
 public:
  explicit McapWriter(const std::string& path) : out_(path) {
    out_.start_crc();
    out_.write(std::as_bytes(std::span(magic)));
    Bytes header;
    append_text(header, "ros2");
    append_text(header, std::string("takt ") + version);
    write_record(Op::header, header);
  }
  [[nodiscard]] MessageEncoding encoding() const override { return MessageEncoding::cdr; }

  void add_channel(const std::string& topic, const std::string& type) override {
    const auto id = static_cast<std::uint16_t>(++channels_);
    Bytes schema, channel;
    append(schema, id);
    append_text(schema, std::string(type).replace(type.find('/'), 1, "/msg/"));
    append_text(schema, "ros2msg");
    append_text(schema, message_definition(MessageEncoding::cdr, type));
    append(channel, id);
    append(channel, id);
    append_text(channel, topic);
    append_text(channel, "cdr");
    append(channel, std::uint32_t{0});  // no metadata
    append_record(known_, Op::schema, schema);
    append_record(known_, Op::channel, channel);
    counts_[id] = 0;
  }

  void write(std::uint32_t channel, Stamp recorded, std::span<const std::byte> message) override {
    if (messages_ == 0) out_.write(known_);
    const auto id = static_cast<std::uint16_t>(channel);
    const auto time = static_cast<std::uint64_t>(to_ns(recorded));
    append(index_[id], time);
    append(index_[id], static_cast<std::uint64_t>(chunk_.size()));
    append(chunk_, static_cast<std::uint8_t>(Op::message));
    append(chunk_, message_head + message.size());
    append(chunk_, id);
    append(chunk_, static_cast<std::uint32_t>(counts_[id]++));
    append(chunk_, time);
    append(chunk_, time);
    append(chunk_, message);
    begin_ = std::min(begin_, time), end_ = std::max(end_, time);
    first_ = std::min(first_, time), last_ = std::max(last_, time);
    ++messages_;
    if (chunk_.size() >= chunk_bytes) write_chunk();
  }

  void finish() override {
    if (messages_ == 0) out_.write(known_);
    write_chunk();
    write_record(Op::data_end, bytes_of(out_.crc()));
    const std::uint64_t summary_at = out_.place();
    out_.start_crc();
    out_.write(known_);
    write_record(Op::statistics, statistics());
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

 private:
  void write_record(Op op, std::span<const std::byte> content) {
    Bytes record;
    append_record(record, op, content);
    out_.write(record);
  }

  void write_chunk() {
    if (chunk_.empty()) return;
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
    write_record(Op::chunk, content);
    const std::uint64_t indexes_at = out_.place();
    Bytes places;
    for (const auto& [id, entries] : index_) {
      append(places, id);
      append(places, out_.place());
      Bytes index;
      append(index, id);
      append(index, static_cast<std::uint32_t>(entries.size()));
      append(index, entries);
      write_record(Op::message_index, index);
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

  [[nodiscard]] Bytes statistics() const {
    Bytes out;
    append(out, messages_);
    append(out, static_cast<std::uint16_t>(channels_));  // schemas
    append(out, channels_);
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

  OutputFile out_;
  Bytes known_;  // schemas and channels
  Bytes chunk_, chunk_indexes_;
  std::map<std::uint16_t, Bytes> index_;  // of the chunk
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::uint64_t messages_ = 0;
  std::uint32_t channels_ = 0, chunks_ = 0;
  std::uint64_t begin_ = UINT64_MAX, end_ = 0;   // of the chunk
  std::uint64_t first_ = UINT64_MAX, last_ = 0;  // of the file
};

}  // namespace

Written write_mcap(const Recording& recording, const std::string& out) {
  McapWriter writer(out);
  return write_messages(recording, writer);
}

}  // namespace takt
