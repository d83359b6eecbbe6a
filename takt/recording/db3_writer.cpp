// SPDX-License-Identifier: Apache-2.0
#include <sqlite3.h>

#include "takt/recording/output_file.h"
#include "takt/recording/sqlite.h"
#include "takt/recording/write_messages.h"

namespace takt {

namespace {

/// rosbag2's storage in the schema that all its releases read.
class Db3Writer : public MessageSink {
 public:
  explicit Db3Writer(const std::string& path) : path_(path) {
    OutputFile(path).finish();  // SQLite takes an empty file for an empty database
    db_ = open_database_to_write(path);
    run("BEGIN");
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT "
        "NOT NULL, offered_qos_profiles TEXT NOT NULL)");
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data "
        "BLOB "
        "NOT NULL)");
    run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    insert_ = std::make_unique<Statement>(*db_, "INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)");
    if (!insert_->valid()) cannot_write(*db_, path_);
  }
  [[nodiscard]] MessageEncoding encoding() const override { return MessageEncoding::cdr; }

  void add_channel(const std::string& topic, const std::string& type) override {
    const std::string ros2_type = std::string(type).insert(type.find('/'), "/msg");
    Statement topic_row(*db_,
                        "INSERT INTO topics(name, type, serialization_format, offered_qos_profiles) "
                        "VALUES(?1, ?2, 'cdr', '')");
    if (!topic_row.valid()) cannot_write(*db_, path_);
    sqlite3_bind_text(topic_row.get(), 1, topic.c_str(), -1, SQLITE_STATIC);
    sqlite3_bind_text(topic_row.get(), 2, ros2_type.c_str(), -1, SQLITE_STATIC);
    execute(topic_row);
  }
  void write(std::uint32_t channel, Stamp recorded, std::span<const std::byte> message) override {
    sqlite3_bind_int64(insert_->get(), 1, channel);
    sqlite3_bind_int64(insert_->get(), 2, to_ns(recorded));
    sqlite3_bind_blob64(insert_->get(), 3, message.data(), message.size(), SQLITE_STATIC);
    execute(*insert_);
    sqlite3_reset(insert_->get());
  }
  void finish() override {
    insert_.reset();
    run("COMMIT");
    db_.reset();
    sync_database(path_);
  }

 private:
  void run(const char* sql) {
    if (sqlite3_exec(db_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK) cannot_write(*db_, path_);
  }
  void execute(Statement& statement) {
    statement.step();
    if (statement.failed()) cannot_write(*db_, path_);
  }

  std::string path_;
  std::shared_ptr<sqlite3> db_;
  std::unique_ptr<Statement> insert_;
};

}  // namespace

Written write_db3(const Recording& recording, const std::string& out) {
  Db3Writer sink(out);
  return write_messages(recording, sink);
}

}  // namespace takt
