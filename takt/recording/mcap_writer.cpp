// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap_writer.h"

#include <algorithm>
#include <concepts>

#include "takt/error.h"
#include "takt/recording/mcap_records.h"

namespace takt {

using mcap::Op;

namespace {

constexpr std::uint16_t schema_id = 1;

template <std::integral T>
std::string raw(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}
std::string sized(const std::string& text) {
  return raw(static_cast<std::uint32_t>(text.size())) + text;
}
std::string record(Op op, const std::string& content) {
  return std::string(1, static_cast<char>(op)) + raw(std::uint64_t{content.size()}) + content;
}
std::string schema_record() {
  return record(Op::schema, raw(schema_id) + sized("takt.Event") + sized("jsonschema") + sized(R"({"type":"object"})"));
}

}  // namespace

McapWriter::McapWriter(const std::string& path) : path_(path), out_(path + ".part") {
  out_.write(std::string(mcap::magic));
  out_.write(record(Op::header, sized("") + sized("takt")));
  out_.write(schema_record());
}

std::string McapWriter::channel_record(std::uint16_t id, const std::string& topic) const {
  return record(Op::channel, raw(id) + raw(schema_id) + sized(topic) + sized("json") + raw(std::uint32_t{0}));
}

std::uint16_t McapWriter::channel_of(const std::string& topic) {
  constexpr std::size_t most = 60'000;
  const auto [found, fresh] = channels_.try_emplace(topic);
  if (fresh) {
    if (channels_.size() > most) throw Error("more topics than a file can hold", path_, "name fewer events");
    found->second.id = static_cast<std::uint16_t>(channels_.size());
    out_.write(channel_record(found->second.id, topic));
  }
  return found->second.id;
}

void McapWriter::write(const std::string& topic, std::uint64_t time_ns, const std::string& json) {
  const std::uint16_t id = channel_of(topic);
  Channel& channel = channels_[topic];
  out_.write(record(Op::message,
                    raw(id) + raw(static_cast<std::uint32_t>(channel.messages)) + raw(time_ns) + raw(time_ns) + json));
  first_ns_ = messages_ == 0 ? time_ns : std::min(first_ns_, time_ns);
  last_ns_ = std::max(last_ns_, time_ns);
  ++channel.messages;
  ++messages_;
}

void McapWriter::finish() {
  out_.write(record(Op::data_end, raw(std::uint32_t{0})));
  const std::uint64_t summary = out_.place();
  out_.write(schema_record());
  std::string counts;
  for (const auto& [topic, channel] : channels_) {
    out_.write(channel_record(channel.id, topic));
    counts += raw(channel.id) + raw(channel.messages);
  }
  out_.write(record(Op::statistics, raw(messages_) + raw(std::uint16_t{1}) +
                                        raw(static_cast<std::uint32_t>(channels_.size())) + raw(std::uint32_t{0}) +
                                        raw(std::uint32_t{0}) + raw(std::uint32_t{0}) + raw(first_ns_) + raw(last_ns_) +
                                        sized(counts)));
  out_.write(record(Op::footer, raw(summary) + raw(std::uint64_t{0}) + raw(std::uint32_t{0})));
  out_.write(std::string(mcap::magic));
  out_.finish();
  publish(path_ + ".part", path_);
}

}  // namespace takt
