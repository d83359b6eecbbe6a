// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/sqlite.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cctype>
#include <filesystem>

#include "takt/error.h"

namespace takt {

namespace {

[[noreturn]] void fail(sqlite3* db, const std::string& where) {
  throw Error(std::string("cannot be opened as an SQLite database: ") + (db ? sqlite3_errmsg(db) : "no memory"), where,
              "check that the copy is complete");
}

std::shared_ptr<sqlite3> open(const std::string& uri, int flags, const std::string& where) {
  sqlite3* raw = nullptr;
  const int result = sqlite3_open_v2(uri.c_str(), &raw, flags | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  std::shared_ptr<sqlite3> db(raw, &sqlite3_close);
  if (result != SQLITE_OK) fail(raw, where);
  // A file that lies about itself must not be believed: no triggers or views of its own, checked cells.
  sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_exec(raw, "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
  return db;
}

/// A path in a URI: everything but letters, digits and a few signs is escaped.
std::string uri_of(const std::string& path) {
  std::string out = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u) || c == '/' || c == '.' || c == '-' || c == '_')
      out += c;
    else
      out += fmt::format("%{:02X}", u);
  }
  return out;
}

}  // namespace

std::shared_ptr<sqlite3> open_database(const std::string& path) {
  return open(uri_of(path) + "?mode=ro&immutable=1", SQLITE_OPEN_READONLY, path);
}

std::shared_ptr<sqlite3> open_database_to_write(const std::string& path) {
  auto db = open(uri_of(path), SQLITE_OPEN_READWRITE, path);
  for (const char* pragma : {"PRAGMA journal_mode=OFF", "PRAGMA synchronous=OFF", "PRAGMA locking_mode=EXCLUSIVE"})
    if (sqlite3_exec(db.get(), pragma, nullptr, nullptr, nullptr) != SQLITE_OK) fail(db.get(), path);
  return db;
}

void cannot_write(sqlite3& db, const std::string& where) {
  throw Error(std::string("cannot be written: ") + sqlite3_errmsg(&db), where, "is there room on the disk?");
}

void sync_database(const std::string& path) {
  const int handle = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0) return;
  ::fsync(handle);
  ::close(handle);
}

std::shared_ptr<sqlite3> view_database(std::span<const std::byte> bytes, const std::string& where) {
  auto db = open("file::memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_MEMORY, where);
  auto* const data = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(bytes.data()));
  const auto size = static_cast<sqlite3_int64>(bytes.size());
  if (sqlite3_deserialize(db.get(), "main", data, size, size, SQLITE_DESERIALIZE_READONLY) != SQLITE_OK)
    fail(db.get(), where);
  return db;
}

Statement::Statement(sqlite3& db, const char* sql) {
  if (sqlite3_prepare_v2(&db, sql, -1, &statement_, nullptr) != SQLITE_OK) statement_ = nullptr;
}

Statement::~Statement() {
  sqlite3_finalize(statement_);
}

bool Statement::step() {
  if (!statement_) return false;
  const int result = sqlite3_step(statement_);
  if (result == SQLITE_ROW) return true;
  failed_ = result != SQLITE_DONE;
  return false;
}

Blob::~Blob() {
  sqlite3_blob_close(blob_);
}

bool Blob::move_to(std::int64_t row) {
  if (blob_ && sqlite3_blob_reopen(blob_, row) == SQLITE_OK) return true;
  sqlite3_blob_close(blob_);
  blob_ = nullptr;
  return sqlite3_blob_open(db_, "main", "messages", "data", row, to_write_ ? 1 : 0, &blob_) == SQLITE_OK;
}

std::optional<std::vector<std::byte>> Blob::read(std::int64_t row, std::uint64_t at, std::uint64_t count) {
  if (!move_to(row)) return std::nullopt;
  const auto size = static_cast<std::uint64_t>(sqlite3_blob_bytes(blob_));
  if (at > size || count > size - at) return std::nullopt;
  std::vector<std::byte> out(static_cast<std::size_t>(count));
  if (count > 0 && sqlite3_blob_read(blob_, out.data(), static_cast<int>(count), static_cast<int>(at)) != SQLITE_OK)
    return std::nullopt;
  return out;
}

bool Blob::write(std::int64_t row, std::uint64_t at, std::span<const std::byte> bytes) {
  return move_to(row) &&
         sqlite3_blob_write(blob_, bytes.data(), static_cast<int>(bytes.size()), static_cast<int>(at)) == SQLITE_OK;
}

}  // namespace takt
