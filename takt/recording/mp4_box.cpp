// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/mp4_box.h"

#include <array>
#include <optional>

#include "takt/error.h"
#include "takt/recording/files.h"

namespace takt {

namespace {

struct Range {
  std::uint64_t begin = 0, end = 0;
};

std::uint64_t big_endian(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  for (const std::byte b : bytes) value = value << 8 | std::to_integer<std::uint64_t>(b);
  return value;
}

/// Where the contents of the first box `name` inside `within` lie [ISO 14496-12, 4.2].
std::optional<Range> child(const ByteSource& file, Range within, std::string_view name) {
  std::array<std::byte, 16> head;
  for (std::uint64_t at = within.begin; at + 8 <= within.end;) {
    const std::size_t readable = within.end - at < 16 ? 8 : 16;
    if (!file.read(at, std::span(head).first(readable))) return std::nullopt;
    std::uint64_t size = big_endian(std::span(head).first(4)), header = 8;
    if (size == 1 && readable == 16) {
      size = big_endian(std::span(head).subspan(8));
      header = 16;
    } else if (size == 0) {
      size = within.end - at;  // to the end
    }
    if (size < header || size > within.end - at) return std::nullopt;
    bool same = true;
    for (std::size_t i = 0; i < 4; ++i) same = same && std::to_integer<char>(head[4 + i]) == name[i];
    if (same) return Range{at + header, at + size};
    at += size;
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::byte> mp4_box(const std::string& path, std::span<const std::string_view> box_path, std::size_t limit) {
  const auto file = open_bytes(path);
  std::optional<Range> range = Range{0, file->size()};
  for (const std::string_view name : box_path)
    if (!(range = child(*file, *range, name))) return {};
  if (range->end - range->begin > limit) return {};
  std::vector<std::byte> bytes(range->end - range->begin);
  if (!file->read(range->begin, bytes)) return {};
  return bytes;
}

}  // namespace takt
