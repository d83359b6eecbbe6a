// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "takt/recording/message_file.h"

struct sqlite3;

namespace takt {

/// rosbag2's SQLite storage, in its first schema and in those with message_definitions. Messages compressed one by one
/// (zstd) are found by their first bytes. Only the wanted beginning of a message is read from the disk.
class Db3Container : public MessageFile {
 public:
  /// Opens read-only and immutable: neither the file nor its folder is written to. Throws takt::Error.
  explicit Db3Container(const std::string& path);
  /// From memory, which must outlive it.
  Db3Container(std::span<const std::byte> bytes, const std::string& where);

  [[nodiscard]] std::vector<std::string> visit(const Wants& wants,
                                               const std::function<void(const Message&)>& see) const override;
  [[nodiscard]] std::vector<Channel> channels() const override;
  [[nodiscard]] std::optional<std::vector<RecordedTimes>> recorded() const override;
  [[nodiscard]] std::shared_ptr<const Bytes> chunk(std::uint64_t) const override { return nullptr; }
  /// A message's place is its id in the table.
  [[nodiscard]] std::shared_ptr<const Bytes> message(const MessagePlace& place) const override;

 private:
  void check() const;

  std::shared_ptr<sqlite3> db_;
  std::string where_;
  mutable std::mutex mutex_;  // one connection, several readers of pictures
};

/// The topics of an open rosbag2 database by their id. Throws takt::Error.
[[nodiscard]] std::vector<std::pair<std::int64_t, Channel>> db3_topics(sqlite3& db, const std::string& where);

/// A message's bytes as they were sent: decompressed where they are a zstd frame. At most `most` of them.
[[nodiscard]] std::vector<std::byte> plain_message(std::vector<std::byte> stored, std::uint64_t most);
[[nodiscard]] bool is_zstd(std::span<const std::byte> bytes);

}  // namespace takt
