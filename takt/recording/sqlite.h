// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;
struct sqlite3_blob;

/// The little of SQLite that rosbag2's storage needs.
namespace takt {

/// Read-only and immutable. Throws takt::Error.
[[nodiscard]] std::shared_ptr<sqlite3> open_database(const std::string& path);
/// To be changed, without a journal: for a file that nobody else knows of yet.
[[nodiscard]] std::shared_ptr<sqlite3> open_database_to_write(const std::string& path);
/// Throws takt::Error with what SQLite says.
[[noreturn]] void cannot_write(sqlite3& db, const std::string& where);
/// To the disk, once the database is closed.
void sync_database(const std::string& path);
/// From memory that outlives it; read-only.
[[nodiscard]] std::shared_ptr<sqlite3> view_database(std::span<const std::byte> bytes, const std::string& where);

/// A prepared statement, released with its scope.
class Statement {
 public:
  Statement(sqlite3& db, const char* sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  [[nodiscard]] bool valid() const { return statement_ != nullptr; }
  /// To the next row; false at the end, or where it failed.
  bool step();
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] sqlite3_stmt* get() const { return statement_; }

 private:
  sqlite3_stmt* statement_ = nullptr;
  bool failed_ = false;
};

/// The bytes of messages.data, row by row.
class Blob {
 public:
  explicit Blob(sqlite3& db, bool to_write = false) : db_(&db), to_write_(to_write) {}
  ~Blob();
  Blob(const Blob&) = delete;
  Blob& operator=(const Blob&) = delete;

  /// Nothing where they are not there.
  [[nodiscard]] std::optional<std::vector<std::byte>> read(std::int64_t row, std::uint64_t at, std::uint64_t count);
  /// In place; false where that fails.
  [[nodiscard]] bool write(std::int64_t row, std::uint64_t at, std::span<const std::byte> bytes);

 private:
  bool move_to(std::int64_t row);

  sqlite3* db_;
  bool to_write_;
  sqlite3_blob* blob_ = nullptr;
};

}  // namespace takt
