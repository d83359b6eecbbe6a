// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mcap_container.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "takt/error.h"
#include "takt/recording/mcap_records.h"

namespace takt {

using namespace mcap;

namespace {

constexpr std::uint64_t most_ahead_bytes = 1U << 25;  // larger chunks are read one at a time

/// What one visit carries along.
struct Visit {
  const Wants& wants;
  const std::function<void(const Message&)>& see;
  Channels channels;
  std::map<std::uint16_t, std::uint64_t> wanted;  // bytes by channel, once asked

  std::uint64_t bytes_of(std::uint16_t id, const Channel& channel) {
    const auto [found, is_new] = wanted.try_emplace(id, 0);
    if (is_new) found->second = wants(channel);
    return found->second;
  }
};

/// A schema, a channel or a message; false where it is broken. `place` says where a message is.
template <class Place>
bool visit_record(ByteWindow& bytes, const Record& record, Visit& visit, Place place) {
  if (record.op == Op::schema || record.op == Op::channel) {
    if (record.size > most_other_bytes) return false;
    const auto content = bytes.at(record.content_at(), record.size);
    return record.op == Op::schema ? visit.channels.learn_schema(content) : visit.channels.learn_channel(content);
  }
  if (record.op != Op::message) return true;
  if (record.size < message_head || record.size - message_head > UINT32_MAX) return false;
  ByteCursor in(bytes.at(record.content_at(), message_head));
  const std::uint16_t id = in.u16();
  in.u32();  // sequence
  const auto recorded = static_cast<std::int64_t>(in.u64());
  const auto channel = visit.channels.all().find(id);
  if (!in.good() || channel == visit.channels.all().end()) return false;
  const std::uint64_t wanted = visit.bytes_of(id, channel->second);
  if (wanted == 0) return true;
  const std::uint64_t size = record.size - message_head;
  const auto head = bytes.at(record.content_at() + message_head, std::min(wanted, size));
  visit.see({channel->second, place(record.content_at() + message_head, static_cast<std::uint32_t>(size)),
             from_ns(recorded), head});
  return true;
}

/// All of a chunk, or false where it is broken; what stands before the break has been seen.
template <class Place>
bool visit_chunk(ByteWindow bytes, Visit& visit, Place place) {
  for (std::uint64_t at = 0; at < bytes.size();) {
    const auto record = record_at(bytes, at);
    if (!record || record->end() > bytes.size() || !visit_record(bytes, *record, visit, place)) return false;
    at = record->end();
  }
  return true;
}

}  // namespace

bool is_mcap(std::string_view head) {
  return head.starts_with(magic);
}

McapContainer::McapContainer(std::shared_ptr<const ByteSource> bytes, const std::string& where)
    : bytes_(std::move(bytes)) {
  std::array<std::byte, magic.size()> head{};
  const bool long_enough = bytes_->read(0, head);
  if (!long_enough || !is_mcap({reinterpret_cast<const char*>(head.data()), head.size()}))
    throw Error("is no MCAP file", where, "check that the copy is complete");
}

std::vector<std::string> McapContainer::visit(const Wants& wants,
                                              const std::function<void(const Message&)>& see) const {
  std::vector<std::string> notes;
  Visit visit{wants, see, {}, {}};
  const std::optional<Summary> summary = read_summary(*bytes_);
  if (summary) visit.channels = summary->channels;
  const auto is_wanted = [&](std::uint64_t chunk) {
    if (!summary || !summary->chunks.contains(chunk)) return true;
    const auto& inside = summary->chunks.at(chunk);
    return std::any_of(inside.begin(), inside.end(), [&](std::uint16_t id) {
      const auto channel = visit.channels.all().find(id);
      return channel == visit.channels.all().end() || visit.bytes_of(id, channel->second) > 0;
    });
  };

  ByteWindow far(*bytes_, 0, bytes_->size());  // for the look ahead
  const auto head_of = [&](ByteWindow& window, std::uint64_t at) {
    const auto record = record_at(window, at);
    return record ? chunk_head(*bytes_, *record) : std::nullopt;
  };
  const auto load = [&](std::uint64_t place, ChunkBuffer& into) {
    ByteWindow here(*bytes_, place, bytes_->size());
    auto record = record_at(here, 0);
    if (!record) return false;
    record->at = place;
    const auto head = chunk_head(*bytes_, *record);
    return head && load_chunk(*bytes_, *head, into);
  };
  const auto next_chunk = [&](std::uint64_t place) -> std::uint64_t {
    constexpr int most_records = 4096;  // a look ahead, not a search
    auto record = record_at(far, place);
    for (int i = 0; record && record->end() < bytes_->size() && i < most_records; ++i) {
      record = record_at(far, record->end());
      if (!record || record->op == Op::data_end || record->op == Op::footer) return 0;
      if (record->op != Op::chunk || record->end() > bytes_->size() || !is_wanted(record->at)) continue;
      const auto head = head_of(far, record->at);
      if (!head || head->compression.empty() || head->uncompressed_size > most_ahead_bytes) return 0;
      return record->at;
    }
    return 0;
  };
  ChunkAhead chunks(load, next_chunk);

  std::uint64_t broken = 0;
  bool closed = false;
  ByteWindow file(*bytes_, 0, bytes_->size());
  for (std::uint64_t at = magic.size(); at < bytes_->size() && !closed;) {
    const auto record = record_at(file, at);
    const bool whole = record && record->end() <= bytes_->size();
    const bool known = record && record->op >= Op::header && static_cast<int>(record->op) != 0;
    if (!whole || !known) {
      if (known && record->op == Op::chunk)
        if (const auto head = chunk_head(*bytes_, *record)) {
          const auto in_chunk = [at](std::uint64_t o, std::uint32_t size) { return MessagePlace{at, o, size}; };
          visit_chunk(ByteWindow(part_of_chunk(*bytes_, *head)), visit, in_chunk);
        }
      notes.push_back(fmt::format("byte {}: {}; what was before it was read", at,
                                  whole ? "the record is broken" : "the file is cut off in a record"));
      break;
    }
    const auto in_file = [](std::uint64_t o, std::uint32_t size) { return MessagePlace{std::nullopt, o, size}; };
    at = record->end();
    closed = record->op == Op::data_end || record->op == Op::footer;
    if (record->op != Op::chunk) {
      if (!visit_record(file, *record, visit, in_file)) ++broken;
      continue;
    }
    if (!is_wanted(record->at)) continue;
    const auto head = chunk_head(*bytes_, *record);
    bool good = false;
    if (head && head->compression.empty()) {
      const auto here = [&head](std::uint64_t o, std::uint32_t size) {
        return MessagePlace{std::nullopt, head->records_at + o, size};
      };
      good = visit_chunk(ByteWindow(*bytes_, head->records_at, head->records_at + head->records_size), visit, here);
    } else if (head) {
      const auto in_chunk = [&record](std::uint64_t o, std::uint32_t size) {
        return MessagePlace{record->at, o, size};
      };
      if (const ChunkBuffer* const chunk = chunks.at(record->at))
        good = visit_chunk(ByteWindow(chunk->records()), visit, in_chunk);
    }
    if (!good) ++broken;
  }
  if (broken > 0)
    notes.push_back(fmt::format("{} chunks or records are broken or fail their checksum and were passed over", broken));
  if (!closed && notes.empty()) notes.emplace_back("the file was never closed: it has no end record");
  return notes;
}

std::vector<Channel> McapContainer::channels() const {
  std::vector<Channel> out;
  if (const auto summary = read_summary(*bytes_); summary && !summary->channels.all().empty()) {
    for (const auto& [id, channel] : summary->channels.all()) out.push_back(channel);
    return out;
  }
  const auto none = [&](const Channel& c) {
    out.push_back(c);
    return std::uint64_t{0};
  };
  static_cast<void>(visit(none, [](const Message&) {}));
  return out;
}

std::shared_ptr<const MessageFile::Bytes> McapContainer::chunk(std::uint64_t place) const {
  ByteWindow file(*bytes_, 0, bytes_->size());
  const auto record = record_at(file, place);
  if (!record || record->op != Op::chunk) return nullptr;
  const auto head = chunk_head(*bytes_, *record);
  if (!head) return nullptr;
  if (record->end() > bytes_->size()) return std::make_shared<const Bytes>(part_of_chunk(*bytes_, *head));
  auto records = chunk_records(*bytes_, *head);
  return records ? std::make_shared<const Bytes>(std::move(*records)) : nullptr;
}

std::shared_ptr<const MessageFile::Bytes> McapContainer::message(const MessagePlace& place) const {
  if (place.offset > bytes_->size() || place.size > bytes_->size() - place.offset) return nullptr;
  auto data = std::make_shared<Bytes>(place.size);
  return bytes_->read(place.offset, *data) ? data : nullptr;
}

}  // namespace takt
