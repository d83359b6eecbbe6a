// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sqlite3.h>

#include <cstdint>
#include <stdexcept>
#include <string>

/// rosbag2's SQLite storage as the recorders of Foxy (old schema) and of Jazzy (new schema) lay it out.
namespace takt::db3_writing {

class Database {
 public:
  explicit Database(const std::string& path, bool new_schema = true) {
    if (sqlite3_open(path.c_str(), &db_) != SQLITE_OK) throw std::runtime_error("cannot make " + path);
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT "
        "NOT NULL,offered_qos_profiles TEXT NOT NULL" +
        std::string(new_schema ? ",type_description_hash TEXT NOT NULL)" : ")"));
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB "
        "NOT NULL)");
    run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    if (!new_schema) return;
    run("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL)");
    run("CREATE TABLE metadata(id INTEGER PRIMARY KEY,metadata_version INTEGER NOT NULL,metadata TEXT NOT NULL)");
    run("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY,topic_type TEXT NOT NULL,encoding TEXT NOT "
        "NULL,encoded_message_definition TEXT NOT NULL,type_description_hash TEXT NOT NULL)");
  }
  ~Database() { sqlite3_close(db_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void topic(int id, const std::string& name, const std::string& type) {
    run("INSERT INTO topics(id,name,type,serialization_format,offered_qos_profiles" +
        std::string(has_hash() ? ",type_description_hash" : "") + ") VALUES(" + std::to_string(id) + ",'" + name +
        "','" + type + "','cdr',''" + (has_hash() ? ",''" : "") + ")");
  }
  void message(int topic, std::int64_t time, const std::string& data) {
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(db_, "INSERT INTO messages(topic_id,timestamp,data) VALUES(?1,?2,?3)", -1, &insert, nullptr);
    sqlite3_bind_int(insert, 1, topic);
    sqlite3_bind_int64(insert, 2, time);
    sqlite3_bind_blob(insert, 3, data.data(), static_cast<int>(data.size()), SQLITE_STATIC);
    sqlite3_step(insert);
    sqlite3_finalize(insert);
  }
  void run(const std::string& sql) {
    if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      throw std::runtime_error(sql + ": " + sqlite3_errmsg(db_));
  }

 private:
  [[nodiscard]] bool has_hash() const {
    return sqlite3_table_column_metadata(db_, "main", "topics", "type_description_hash", nullptr, nullptr, nullptr,
                                         nullptr, nullptr) == SQLITE_OK;
  }
  sqlite3* db_ = nullptr;
};

}  // namespace takt::db3_writing
