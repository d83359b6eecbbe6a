// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "takt/recording/record_format.h"

namespace takt {

/// Reads and decompresses the next chunks on other threads while one is looked at. What comes out, and in which order,
/// is the same as without.
class ChunkAhead {
 public:
  /// The first wanted, compressed and not too large chunk behind another; nothing where there is none.
  using Next = std::function<std::optional<FileRecord>(const FileRecord& chunk)>;
  ChunkAhead(const ByteSource& file, Next next) : file_(file), next_(std::move(next)) {}
  ~ChunkAhead();
  ChunkAhead(const ChunkAhead&) = delete;
  ChunkAhead& operator=(const ChunkAhead&) = delete;

  /// The chunk's records, valid until the next call; nullptr where they are broken.
  [[nodiscard]] const ChunkBuffer* at(const FileRecord& chunk);

 private:
  struct Job {
    enum class State { waiting, under_way, done };
    FileRecord chunk;
    ChunkBuffer buffer;
    State state = State::waiting;
    bool good = false;
  };
  void add(const FileRecord& chunk);
  [[nodiscard]] Job* first_waiting();
  void load(Job& job, std::unique_lock<std::mutex>& lock);
  void finish(Job& job, std::unique_lock<std::mutex>& lock);
  void work();

  const ByteSource& file_;
  Next next_;
  std::mutex mutex_;  // over all below
  std::condition_variable changed_;
  std::deque<std::unique_ptr<Job>> jobs_;  // in order of place
  std::unique_ptr<Job> current_;
  std::vector<std::unique_ptr<Job>> spare_;
  std::vector<std::thread> workers_;
  bool closing_ = false;
};

}  // namespace takt
