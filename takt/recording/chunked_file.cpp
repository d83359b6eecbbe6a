// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/chunked_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "takt/recording/chunk_ahead.h"
#include "takt/recording/record_walk.h"

namespace takt {

namespace {

using Kind = FileRecord::Kind;

constexpr std::uint64_t most_ahead_bytes = 1U << 24;  // larger chunks are read one at a time

/// One reading of a file, from its first record to its last.
class Reading {
 public:
  Reading(const ByteSource& bytes, const RecordFormat& format, const Wants& wants,
          const std::function<void(const Message&)>& see)
      : bytes_(bytes),
        format_(format),
        wants_(wants),
        see_(see),
        index_(format.read_index(bytes)),
        ahead_(bytes, 0, bytes.size()),
        chunks_(bytes, [this](const FileRecord& chunk) { return next_chunk(chunk); }) {
    if (index_) known_ = index_->known;
  }

  std::vector<std::string> run() {
    ByteWindow file(bytes_, 0, bytes_.size());
    RecordWalk walk(format_, file, format_.first_record());
    bool closed = false;
    while (!closed) {
      const std::uint64_t damaged = walk.damage().places;
      const auto record = walk.next();
      if (!record) break;
      closed = record->kind == Kind::end;
      if (record->kind == Kind::zeros) zeros_ += record->end - record->at;
      if (record->kind == Kind::unknown) ++unknown_;
      if (walk.damage().places > damaged) begin_chunk(false);
      const bool good = record->kind == Kind::chunk ? see_chunk(*record) : see_record(file, *record, Origin{});
      if (record->kind == Kind::chunk) chunk_is_whole_ = good;
      if (record->kind == Kind::index && !chunk_is_whole_) count_lost(*record);
      if (good) continue;
      ++broken_;
      walk.doubt_last();
    }
    if (!closed && walk.broke_off()) see_rest(walk);
    note_damage(walk.damage(), "");
    note_damage(inside_, " inside of chunks");
    if (broken_ > 0)
      notes_.push_back(
          fmt::format("{} chunks or records are broken or fail their checksum and were passed over", broken_));
    if (!lost_.empty()) note_lost();
    if (unknown_ > 0) notes_.push_back(fmt::format("{} records of unknown kinds were passed over", unknown_));
    if (zeros_ > 0) notes_.push_back(fmt::format("{} zero bytes between records were passed over", zeros_));
    if (!closed && format_.has_end_record() && notes_.empty())
      notes_.emplace_back("the file was never closed: it has no end record");
    return std::move(notes_);
  }

 private:
  /// What places count from: the file's part from `base` on, or a chunk's records in memory.
  struct Origin {
    std::optional<std::uint64_t> chunk;
    std::uint64_t base = 0;
  };

  std::uint64_t wanted_bytes(std::uint32_t id, const Channel& channel) {
    const auto [found, is_new] = wanted_.try_emplace(id, 0);
    if (is_new) found->second = wants_(channel);
    return found->second;
  }

  /// As the index knows; a chunk that it does not know is looked into.
  bool is_wanted(std::uint64_t chunk) {
    const auto inside = index_ ? index_->chunks.find(chunk) : decltype(index_->chunks.end()){};
    if (!index_ || inside == index_->chunks.end()) return true;
    return std::any_of(inside->second.begin(), inside->second.end(), [&](std::uint32_t id) {
      const auto channel = known_.channels.find(id);
      return channel == known_.channels.end() || wanted_bytes(id, channel->second) > 0;
    });
  }

  /// A channel or a message; false where it is broken.
  bool see_record(ByteWindow& bytes, const FileRecord& record, const Origin& origin) {
    if (record.kind == Kind::channel) return format_.learn(bytes, record, known_);
    if (record.kind != Kind::message) return true;
    const auto channel = known_.channels.find(record.channel);
    const std::uint64_t size = record.end - record.data_at;
    if (channel == known_.channels.end() || size > UINT32_MAX) return false;
    ++seen_[record.channel];
    const std::uint64_t wanted = wanted_bytes(record.channel, channel->second);
    if (wanted == 0) return true;
    const auto head = bytes.at(record.data_at, std::min(wanted, size));
    const MessagePlace place{origin.chunk, origin.base + record.data_at, static_cast<std::uint32_t>(size)};
    see_({channel->second, place, record.recorded, head});
    return true;
  }

  /// False where they are broken; what could be read of them has been seen.
  bool see_records(ByteWindow bytes, const Origin& origin) {
    RecordWalk walk(format_, bytes, 0);
    bool good = true;
    while (const auto record = walk.next()) {
      if (record->kind == Kind::unknown) ++unknown_;
      if (see_record(bytes, *record, origin)) continue;
      good = false;
      walk.doubt_last();
    }
    if (inside_.places == 0) inside_.first_at = origin.chunk.value_or(origin.base) + walk.damage().first_at;
    inside_.places += walk.damage().places;
    inside_.bytes += walk.damage().bytes;
    return good && walk.damage().places == 0 && !walk.broke_off();
  }

  bool see_chunk(const FileRecord& chunk) {
    begin_chunk(true);
    if (!is_wanted(chunk.at)) return true;
    const StoredRecords& records = chunk.records;
    if (records.compression == Compression::none)
      return see_records(ByteWindow(bytes_, records.at, records.at + records.size), Origin{std::nullopt, records.at}) &&
             records.size == records.plain_size;
    const ChunkBuffer* const loaded = chunks_.at(chunk);
    return loaded && see_records(ByteWindow(loaded->records()), Origin{chunk.at});
  }

  /// Messages are counted from here on, to be held against the indexes that follow.
  void begin_chunk(bool is_whole) {
    chunk_is_whole_ = is_whole;
    seen_.clear();
  }
  /// An index tells how many messages there were in a chunk that could not be read, or not in full.
  void count_lost(const FileRecord& index) {
    const auto channel = known_.channels.find(index.channel);
    const std::uint64_t seen = seen_[index.channel];
    if (channel != known_.channels.end() && index.count > seen && wanted_bytes(index.channel, channel->second) > 0)
      lost_[channel->second.topic] += index.count - seen;
  }
  void note_lost() {
    std::string all;
    for (const auto& [topic, count] : lost_) all += fmt::format("{}{} of {}", all.empty() ? "" : ", ", count, topic);
    notes_.push_back("messages lost, as the indexes of broken chunks count them: " + all);
  }
  void note_damage(const RecordWalk::Damage& damage, const char* where) {
    if (damage.places > 0)
      notes_.push_back(
          fmt::format("damaged in {} places{}, {} bytes in all, the first at byte {}: reading went on "
                      "behind them",
                      damage.places, where, damage.bytes, damage.first_at));
  }

  /// What the walk could not pass: the rest of the file, of which a chunk that is cut off can be read in part.
  void see_rest(const RecordWalk& walk) {
    const auto& record = walk.cut_off();
    notes_.push_back(fmt::format("byte {}: {}; what was before it was read", walk.place(),
                                 record ? "the file is cut off in a record" : "the record is broken"));
    if (!record || record->kind != Kind::chunk || record->broken) return;
    if (record->records.compression == Compression::none)
      see_records(ByteWindow(bytes_, record->records.at, bytes_.size()), Origin{std::nullopt, record->records.at});
    else
      see_records(ByteWindow(load_part(bytes_, record->records)), Origin{record->at});
  }

  /// The next chunk that is worth to be decompressed while this one is looked at.
  std::optional<FileRecord> next_chunk(const FileRecord& chunk) {
    constexpr int most_records = 4096;  // a look ahead, not a search
    RecordWalk walk(format_, ahead_, chunk.end);
    for (int i = 0; i < most_records; ++i) {
      const auto record = walk.next();
      if (!record || record->kind == Kind::end) break;
      if (record->kind != Kind::chunk || record->broken || !is_wanted(record->at)) continue;
      const bool fits =
          record->records.compression != Compression::none && record->records.plain_size <= most_ahead_bytes;
      return fits ? record : std::nullopt;
    }
    return std::nullopt;
  }

  const ByteSource& bytes_;
  const RecordFormat& format_;
  const Wants& wants_;
  const std::function<void(const Message&)>& see_;
  std::optional<FileIndex> index_;
  KnownChannels known_;
  std::map<std::uint32_t, std::uint64_t> wanted_;  // bytes by channel, once asked
  ByteWindow ahead_;
  ChunkAhead chunks_;
  std::uint64_t broken_ = 0, zeros_ = 0, unknown_ = 0;
  RecordWalk::Damage inside_;  // of chunks
  bool chunk_is_whole_ = true;
  std::map<std::uint32_t, std::uint64_t> seen_;  // messages since the last chunk began, by channel
  std::map<std::string, std::uint64_t> lost_;
  std::vector<std::string> notes_;
};

}  // namespace

std::vector<std::string> ChunkedFile::visit(const Wants& wants, const std::function<void(const Message&)>& see) const {
  return Reading(*bytes_, format_, wants, see).run();
}

std::vector<Channel> ChunkedFile::channels() const {
  std::vector<Channel> out;
  if (const auto index = format_.read_index(*bytes_); index && !index->known.channels.empty()) {
    for (const auto& [id, channel] : index->known.channels) out.push_back(channel);
    return out;
  }
  const auto none = [&](const Channel& c) {
    out.push_back(c);
    return std::uint64_t{0};
  };
  static_cast<void>(visit(none, [](const Message&) {}));
  return out;
}

std::optional<std::vector<RecordedTimes>> ChunkedFile::recorded() const {
  const auto index = format_.read_index(*bytes_);
  if (!index) return std::nullopt;
  std::map<std::uint32_t, RecordedTimes> all;
  for (const auto& [id, channel] : index->known.channels) all[id].channel = channel;
  ByteWindow file(*bytes_, 0, bytes_->size());
  RecordWalk walk(format_, file, format_.first_record());
  std::set<std::uint32_t> untold;  // channels of the last chunk, until their index comes
  while (const auto record = walk.next()) {
    if (record->kind == Kind::end) break;
    if (record->kind == Kind::chunk) {
      const auto inside = index->chunks.find(record->at);
      if (!untold.empty() || inside == index->chunks.end()) return std::nullopt;
      untold.insert(inside->second.begin(), inside->second.end());
      continue;
    }
    const auto known = all.find(record->channel);
    if (record->kind != Kind::index && record->kind != Kind::message) continue;
    if (known == all.end()) return std::nullopt;
    if (record->kind == Kind::message)
      known->second.times.push_back(record->recorded);
    else
      format_.read_times(file, *record, known->second.times);
    if (record->kind == Kind::index) untold.erase(record->channel);
  }
  if (!untold.empty() || walk.damage().places > 0) return std::nullopt;
  std::vector<RecordedTimes> out;
  for (auto& [id, times] : all) out.push_back(std::move(times));
  return out;
}

std::string ChunkedFile::first_bytes(const ByteSource& bytes, std::size_t count) {
  std::string head(static_cast<std::size_t>(std::min<std::uint64_t>(count, bytes.size())), '\0');
  return bytes.read(0, std::as_writable_bytes(std::span(head))) ? head : std::string();
}

std::shared_ptr<const MessageFile::Bytes> ChunkedFile::chunk(std::uint64_t place) const {
  ByteWindow file(*bytes_, 0, bytes_->size());
  const auto record = format_.record_at(file, place);
  if (!record || record->kind != Kind::chunk || record->broken) return nullptr;
  if (record->end > bytes_->size()) return std::make_shared<const Bytes>(load_part(*bytes_, record->records));
  ChunkBuffer buffer;
  if (!load_records(*bytes_, record->records, buffer)) return nullptr;
  buffer.plain.resize(buffer.size);
  return std::make_shared<const Bytes>(std::move(buffer.plain));
}

std::shared_ptr<const MessageFile::Bytes> ChunkedFile::message(const MessagePlace& place) const {
  if (place.offset > bytes_->size() || place.size > bytes_->size() - place.offset) return nullptr;
  auto data = std::make_shared<Bytes>(place.size);
  return bytes_->read(place.offset, *data) ? data : nullptr;
}

}  // namespace takt
