// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/db3_container.h"

#include <fmt/core.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <map>

#include "takt/error.h"
#include "takt/recording/decompress.h"
#include "takt/recording/sqlite.h"

namespace takt {

namespace {

constexpr std::uint64_t most_message_bytes = 1ULL << 30;
constexpr std::array zstd_magic{std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f}, std::byte{0xfd}};

std::string text_column(sqlite3_stmt* row, int column) {
  const auto* const text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text ? std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(row, column))) : std::string();
}

/// Definitions by type, in the schemas that have them.
std::map<std::string, std::string> definitions(sqlite3& db) {
  std::map<std::string, std::string> out;
  Statement rows(db, "SELECT topic_type, encoded_message_definition FROM message_definitions");
  while (rows.step()) out[text_column(rows.get(), 0)] = text_column(rows.get(), 1);
  return out;
}

}  // namespace

bool is_zstd(std::span<const std::byte> bytes) {
  return bytes.size() >= zstd_magic.size() && std::equal(zstd_magic.begin(), zstd_magic.end(), bytes.begin());
}

std::vector<std::byte> plain_message(std::vector<std::byte> stored, std::uint64_t most) {
  if (is_zstd(stored))
    return decompress_part(Compression::zstd, stored, static_cast<std::size_t>(std::min(most, most_message_bytes)));
  if (stored.size() > most) stored.resize(static_cast<std::size_t>(most));
  return stored;
}

std::vector<std::pair<std::int64_t, Channel>> db3_topics(sqlite3& db, const std::string& where) {
  const std::map<std::string, std::string> known = definitions(db);
  std::vector<std::pair<std::int64_t, Channel>> out;
  Statement rows(db, "SELECT id, name, type, serialization_format FROM topics");
  if (!rows.valid())
    throw Error("is no rosbag2 database: " + std::string(sqlite3_errmsg(&db)), where,
                "check that the copy is complete");
  while (rows.step()) {
    const std::string type = text_column(rows.get(), 2);
    Channel channel;
    channel.topic = text_column(rows.get(), 1);
    channel.type = plain_type(type);
    channel.encoding = text_column(rows.get(), 3) == "cdr" ? MessageEncoding::cdr : MessageEncoding::other;
    if (const auto definition = known.find(type); definition != known.end()) channel.definition = definition->second;
    out.emplace_back(sqlite3_column_int64(rows.get(), 0), std::move(channel));
  }
  return out;
}

Db3Container::Db3Container(const std::string& path) : db_(open_database(path)), where_(path) {
  check();
}

Db3Container::Db3Container(std::span<const std::byte> bytes, const std::string& where)
    : db_(view_database(bytes, where)), where_(where) {
  check();
}

void Db3Container::check() const {
  static_cast<void>(db3_topics(*db_, where_));
  if (!Statement(*db_, "SELECT id, topic_id, timestamp, data FROM messages").valid())
    throw Error("is no rosbag2 database: " + std::string(sqlite3_errmsg(db_.get())), where_,
                "check that the copy is complete");
}

std::vector<Channel> Db3Container::channels() const {
  const std::lock_guard lock(mutex_);
  std::vector<Channel> out;
  for (auto& [id, channel] : db3_topics(*db_, where_)) out.push_back(std::move(channel));
  return out;
}

std::optional<std::vector<RecordedTimes>> Db3Container::recorded() const {
  const std::lock_guard lock(mutex_);
  std::map<std::int64_t, RecordedTimes> all;
  for (auto& [id, channel] : db3_topics(*db_, where_)) all[id].channel = std::move(channel);
  Statement rows(*db_, "SELECT topic_id, timestamp FROM messages ORDER BY id");
  while (rows.step())
    if (const auto topic = all.find(sqlite3_column_int64(rows.get(), 0)); topic != all.end())
      topic->second.times.push_back(from_ns(sqlite3_column_int64(rows.get(), 1)));
  if (rows.failed()) return std::nullopt;
  std::vector<RecordedTimes> out;
  for (auto& [id, times] : all) out.push_back(std::move(times));
  return out;
}

std::vector<std::string> Db3Container::visit(const Wants& wants, const std::function<void(const Message&)>& see) const {
  const std::lock_guard lock(mutex_);
  struct Topic {
    Channel channel;
    std::uint64_t wanted;
  };
  std::map<std::int64_t, Topic> topics;
  for (auto& [id, channel] : db3_topics(*db_, where_)) {
    const std::uint64_t wanted = wants(channel);
    topics.emplace(id, Topic{std::move(channel), wanted});
  }
  // length() does not read what it measures, so a picture's pages are visited only as far as they are wanted.
  Statement rows(*db_, "SELECT id, topic_id, timestamp, length(data) FROM messages ORDER BY id");
  Blob blob(*db_);
  std::size_t broken = 0;
  while (rows.step()) {
    const std::int64_t id = sqlite3_column_int64(rows.get(), 0);
    const auto topic = topics.find(sqlite3_column_int64(rows.get(), 1));
    if (topic == topics.end()) {
      ++broken;
      continue;
    }
    const std::uint64_t wanted = topic->second.wanted;
    if (wanted == 0) continue;
    const auto size = static_cast<std::uint64_t>(std::max<std::int64_t>(0, sqlite3_column_int64(rows.get(), 3)));
    auto stored = blob.read(id, 0, std::min<std::uint64_t>(size, wanted));
    if (stored && is_zstd(*stored) && stored->size() < size) stored = blob.read(id, 0, size);
    if (!stored) {
      ++broken;
      continue;
    }
    const Bytes head = plain_message(std::move(*stored), wanted);
    see({topic->second.channel,
         {std::nullopt, static_cast<std::uint64_t>(id), static_cast<std::uint32_t>(size)},
         from_ns(sqlite3_column_int64(rows.get(), 2)),
         head});
  }
  std::vector<std::string> notes;
  if (rows.failed())
    notes.push_back(fmt::format("the database is broken ({}); what was before it was read", sqlite3_errmsg(db_.get())));
  if (broken > 0) notes.push_back(fmt::format("{} messages cannot be read or have no topic", broken));
  return notes;
}

std::shared_ptr<const MessageFile::Bytes> Db3Container::message(const MessagePlace& place) const {
  const std::lock_guard lock(mutex_);
  Blob blob(*db_);
  auto stored = blob.read(static_cast<std::int64_t>(place.offset), 0, place.size);
  if (!stored) return nullptr;
  return std::make_shared<const Bytes>(plain_message(std::move(*stored), most_message_bytes));
}

}  // namespace takt
