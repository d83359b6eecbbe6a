// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "takt/recording/files.h"

namespace takt {

/// Bytes of a file, or of memory, seen through a window that mostly moves forward: what lies between two looks far
/// apart is never read, and looks close together cost one read in hundreds.
class ByteWindow {
 public:
  /// The part [begin, end) of a file; offsets count from `begin`.
  ByteWindow(const ByteSource& file, std::uint64_t begin, std::uint64_t end);
  /// Memory: looks copy nothing.
  explicit ByteWindow(std::span<const std::byte> memory) : memory_(memory), size_(memory.size()) {}

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Valid until the next look. Empty where the range is not there to its end.
  [[nodiscard]] std::span<const std::byte> at(std::uint64_t offset, std::uint64_t count);

 private:
  const ByteSource* file_ = nullptr;
  std::span<const std::byte> memory_;
  std::uint64_t begin_ = 0;
  std::uint64_t size_ = 0;
  std::vector<std::byte> block_;
  std::uint64_t block_at_ = 0;
  std::size_t block_size_ = 0;
};

}  // namespace takt
