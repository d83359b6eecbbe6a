// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <sqlite3.h>

#include <filesystem>
#include <map>
#include <optional>

#include "takt/error.h"
#include "takt/recording/db3_container.h"
#include "takt/recording/decompress.h"
#include "takt/recording/message_restamper.h"
#include "takt/recording/output_file.h"
#include "takt/recording/rosbag2.h"
#include "takt/recording/sqlite.h"

namespace takt {

namespace {

using Bytes = std::vector<std::byte>;

/// A message of another length: only those that are compressed one by one.
void exchange(sqlite3& db, std::int64_t id, const Bytes& data, const std::string& where) {
  Statement update(db, "UPDATE messages SET data = ?1 WHERE id = ?2");
  if (!update.valid()) cannot_write(db, where);
  sqlite3_bind_blob64(update.get(), 1, data.data(), data.size(), SQLITE_STATIC);
  sqlite3_bind_int64(update.get(), 2, id);
  update.step();
  if (update.failed()) cannot_write(db, where);
}

void move_record_time(sqlite3& db, std::int64_t id, Duration by, const std::string& where) {
  Statement update(db, "UPDATE messages SET timestamp = timestamp + ?1 WHERE id = ?2");
  if (!update.valid()) cannot_write(db, where);
  sqlite3_bind_int64(update.get(), 1, by.count());
  sqlite3_bind_int64(update.get(), 2, id);
  update.step();
  if (update.failed()) cannot_write(db, where);
}

}  // namespace

Restamped restamp_db3(const std::string& in, const std::string& out, const Restamping& order, const OpenOptions&) {
  MessageRestamper restamper(Db3Container(in).channels(), order, in);
  std::shared_ptr<sqlite3> db;
  if (out.empty()) {
    db = open_database(in);
  } else {
    OutputFile copy(out);
    const auto from = open_bytes(in);
    copy.copy(*from, 0, from->size());
    copy.finish();
    db = open_database_to_write(out);
  }
  std::map<std::int64_t, Channel> wanted;
  for (auto& [id, channel] : db3_topics(*db, in))
    if (restamper.moves(channel)) wanted.emplace(id, std::move(channel));

  // The ids are read first, a page of them at a time: a table that is being read is not changed.
  constexpr int page = 10'000;
  std::int64_t last = std::numeric_limits<std::int64_t>::min();
  bool first = true, changed = false;
  while (true) {
    struct Row {
      std::int64_t id, topic, size;
    };
    std::vector<Row> rows;
    {
      Statement some(*db, first ? "SELECT id, topic_id, length(data) FROM messages WHERE id >= ?1 ORDER BY id LIMIT ?2"
                                : "SELECT id, topic_id, length(data) FROM messages WHERE id > ?1 ORDER BY id LIMIT ?2");
      sqlite3_bind_int64(some.get(), 1, last);
      sqlite3_bind_int(some.get(), 2, page);
      while (some.step())
        rows.push_back({sqlite3_column_int64(some.get(), 0), sqlite3_column_int64(some.get(), 1),
                        sqlite3_column_int64(some.get(), 2)});
      if (some.failed()) throw Error(std::string("is broken: ") + sqlite3_errmsg(db.get()), in, "copy it again");
    }
    if (rows.empty()) break;
    first = false;
    last = rows.back().id;
    Blob blob(*db, !out.empty());
    for (const Row& row : rows) {
      const auto channel = wanted.find(row.topic);
      if (channel == wanted.end()) continue;
      // Without compression only the message's beginning is read and written.
      constexpr std::int64_t head_bytes = 1 << 16;
      auto stored = blob.read(row.id, 0, static_cast<std::uint64_t>(std::min(row.size, head_bytes)));
      const bool compressed = stored && is_zstd(*stored);
      if (compressed && row.size > head_bytes) stored = blob.read(row.id, 0, static_cast<std::uint64_t>(row.size));
      Bytes message = stored ? plain_message(std::move(*stored), UINT64_MAX) : Bytes{};
      const auto done = restamper.restamp(channel->second, message);
      if (!done || out.empty()) continue;
      changed = true;
      if (compressed)
        exchange(*db, row.id, compress(Compression::zstd, message), out);
      else if (!blob.write(row.id, 0, message))
        cannot_write(*db, out);
      if (order.record_time) move_record_time(*db, row.id, done->moved_by(), out);
    }
  }
  db.reset();
  if (changed) sync_database(out);
  return restamper.finish();
}

}  // namespace takt
