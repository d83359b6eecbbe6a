// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "takt/error.h"
#include "takt/recording/byte_edit.h"
#include "takt/recording/message_writer.h"
#include "takt/recording/output_file.h"
#include "takt/recording/ros1_records.h"
#include "takt/recording/write_messages.h"

namespace takt {

using namespace ros1;

namespace {

using Bytes = std::vector<std::byte>;
constexpr std::size_t chunk_bytes = 768U << 10;
constexpr std::size_t bag_header_bytes = 4096;  // what rosbag keeps free for it

/// A record's header: `name=value` fields.
class Fields {
 public:
  template <class T>
  Fields& number(std::string_view name, T value) {
    return text(name, {reinterpret_cast<const char*>(&value), sizeof value});
  }
  Fields& op(Op op) { return number("op", static_cast<std::uint8_t>(op)); }
  Fields& time(std::string_view name, Stamp t) {
    Bytes value(8);
    if (!put_time(value, t)) throw Error("its record time does not fit into a bag", "a message", "convert to MCAP");
    return text(name, {reinterpret_cast<const char*>(value.data()), value.size()});
  }
  Fields& text(std::string_view name, std::string_view value) {
    append_text(bytes_, std::string(name) + "=" + std::string(value));
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

void append_record(Bytes& out, const Fields& header, std::span<const std::byte> data) {
  append(out, static_cast<std::uint32_t>(header.bytes().size()));
  append(out, header.bytes());
  append(out, static_cast<std::uint32_t>(data.size()));
  append(out, data);
}

class Ros1Writer : public MessageSink {
 public:
  explicit Ros1Writer(const std::string& path) : out_(path) {
    out_.write(std::as_bytes(std::span(magic)));
    out_.write(bag_header(0));
  }
  [[nodiscard]] MessageEncoding encoding() const override { return MessageEncoding::ros1; }

  void add_channel(const std::string& topic, const std::string& type) override {
    Fields data;
    data.text("topic", topic).text("type", type).text("md5sum", ros1_md5(type));
    data.text("message_definition", message_definition(MessageEncoding::ros1, type));
    append_record(connections_, Fields().op(Op::connection).number("conn", ++channels_).text("topic", topic),
                  data.bytes());
  }

  void write(std::uint32_t channel, Stamp recorded, std::span<const std::byte> message) override {
    if (chunk_.empty()) {
      chunk_ = connections_;  // so that a bag without its index can be read from any chunk on
      start_ = end_ = recorded;
    }
    Bytes time(8);
    Fields header;
    header.op(Op::message).number("conn", channel).time("time", recorded);
    static_cast<void>(put_time(time, recorded));
    append(index_[channel], time);
    append(index_[channel], static_cast<std::uint32_t>(chunk_.size()));
    append_record(chunk_, header, message);
    start_ = std::min(start_, recorded), end_ = std::max(end_, recorded);
    if (chunk_.size() >= chunk_bytes) write_chunk();
  }

  void finish() override {
    write_chunk();
    const std::uint64_t index_at = out_.place();
    out_.write(connections_);
    out_.write(chunk_infos_);
    out_.patch(magic.size(), bag_header(index_at));
    out_.finish();
  }

 private:
  [[nodiscard]] Bytes bag_header(std::uint64_t index_at) const {
    Fields header;
    header.op(Op::bag).number("index_pos", index_at).number("conn_count", channels_).number("chunk_count", chunks_);
    Bytes out;
    append_record(out, header, Bytes(bag_header_bytes - 8 - header.bytes().size(), std::byte{' '}));
    return out;
  }

  void write_chunk() {
    if (chunk_.empty()) return;
    const std::uint64_t at = out_.place();
    Bytes record, counts;
    append_record(
        record,
        Fields().op(Op::chunk).text("compression", "lz4").number("size", static_cast<std::uint32_t>(chunk_.size())),
        compress(Compression::lz4, chunk_));
    for (const auto& [id, entries] : index_) {
      const auto count = static_cast<std::uint32_t>(entries.size() / 12);
      append_record(record,
                    Fields().op(Op::index).number("ver", std::uint32_t{1}).number("conn", id).number("count", count),
                    entries);
      append(counts, id);
      append(counts, count);
    }
    out_.write(record);
    append_record(chunk_infos_,
                  Fields()
                      .op(Op::chunk_info)
                      .number("ver", std::uint32_t{1})
                      .number("chunk_pos", at)
                      .time("start_time", start_)
                      .time("end_time", end_)
                      .number("count", static_cast<std::uint32_t>(index_.size())),
                  counts);
    ++chunks_;
    chunk_.clear();
    index_.clear();
  }

  OutputFile out_;
  Bytes connections_, chunk_, chunk_infos_;
  std::map<std::uint32_t, Bytes> index_;  // of the chunk
  std::uint32_t channels_ = 0, chunks_ = 0;
  Stamp start_{}, end_{};  // of the chunk
};

}  // namespace

Written write_ros1_bag(const Recording& recording, const std::string& out) {
  Ros1Writer writer(out);
  return write_messages(recording, writer);
}

}  // namespace takt
