// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <span>
#include <vector>

namespace takt {

/// The memory for a chunk while it is read and decompressed, used again for the next one.
struct ChunkBuffer {
  std::vector<std::byte> stored, plain;
  std::size_t size = 0;  ///< of the records, the first bytes of `plain`

  [[nodiscard]] std::span<const std::byte> records() const { return std::span(plain).first(size); }
};

/// Reads and decompresses the next chunks on other threads while one is looked at. What comes out, and in which order,
/// is the same as without.
class ChunkAhead {
 public:
  /// Fills a buffer with the chunk at a place; false where it is broken. Called from several threads at once.
  using Load = std::function<bool(std::uint64_t place, ChunkBuffer& into)>;
  /// The place of the first wanted, compressed and not too large chunk behind a place; 0 where there is none.
  using Next = std::function<std::uint64_t(std::uint64_t place)>;
  ChunkAhead(Load load, Next next) : load_(std::move(load)), next_(std::move(next)) {}

  /// The chunk at `place`, valid until the next call; nullptr where it is broken.
  [[nodiscard]] const ChunkBuffer* at(std::uint64_t place);

 private:
  struct Job {
    std::uint64_t place;
    std::unique_ptr<ChunkBuffer> buffer;
    std::future<bool> done;
  };
  void start(std::uint64_t place);

  Load load_;
  Next next_;
  std::deque<Job> jobs_;  // in order of place
  std::unique_ptr<ChunkBuffer> current_;
  std::vector<std::unique_ptr<ChunkBuffer>> spare_;
};

}  // namespace takt
