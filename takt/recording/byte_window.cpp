// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/byte_window.h"

#include <algorithm>

namespace takt {

namespace {

constexpr std::uint64_t far_read = 1U << 13;   // after a jump: a message's beginning and the next record's header
constexpr std::uint64_t near_read = 1U << 18;  // in passing

}  // namespace

ByteWindow::ByteWindow(const ByteSource& file, std::uint64_t begin, std::uint64_t end)
    : file_(&file), begin_(begin), size_(std::max(begin, std::min(end, file.size())) - begin) {}

std::span<const std::byte> ByteWindow::at(std::uint64_t offset, std::uint64_t count) {
  if (count == 0 || offset > size_ || count > size_ - offset) return {};
  if (!file_) return memory_.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(count));
  const bool inside = offset >= block_at_ && offset + count <= block_at_ + block_size_;
  if (!inside) {
    const bool adjoining = block_size_ > 0 && offset >= block_at_ && offset <= block_at_ + block_size_ + far_read;
    const std::uint64_t wanted = std::min(size_ - offset, std::max(count, adjoining ? near_read : far_read));
    if (block_.size() < wanted) block_.resize(static_cast<std::size_t>(wanted));
    block_size_ = 0;
    if (!file_->read(begin_ + offset, std::span(block_).first(static_cast<std::size_t>(wanted)))) return {};
    block_at_ = offset;
    block_size_ = static_cast<std::size_t>(wanted);
  }
  return std::span<const std::byte>(block_).subspan(static_cast<std::size_t>(offset - block_at_),
                                                    static_cast<std::size_t>(count));
}

}  // namespace takt
