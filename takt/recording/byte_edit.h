// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

/// Little-endian numbers into bytes, for those who write what ByteCursor reads.
namespace takt {

template <class T>
[[nodiscard]] std::span<const std::byte> bytes_of(const T& value) {
  static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
  return std::as_bytes(std::span(&value, 1));
}

inline void append(std::vector<std::byte>& out, std::span<const std::byte> bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}
template <class T>
requires std::is_arithmetic_v<T>
void append(std::vector<std::byte>& out, T value) {
  append(out, bytes_of(value));
}
/// A text after its length.
inline void append_text(std::vector<std::byte>& out, std::string_view text) {
  append(out, static_cast<std::uint32_t>(text.size()));
  append(out, std::as_bytes(std::span(text)));
}

/// 0 where it would reach beyond the end.
template <class T>
[[nodiscard]] T number_at(std::span<const std::byte> bytes, std::size_t at) {
  T value{};
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}
/// Nothing happens where it would reach beyond the end.
template <class T>
void put_number(std::span<std::byte> bytes, std::size_t at, T value) {
  if (at + sizeof value <= bytes.size()) std::memcpy(bytes.data() + at, &value, sizeof value);
}

}  // namespace takt
