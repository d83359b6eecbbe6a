// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Writes GPMF for tests: what a camera would have written, made by hand.
namespace takt::gpmf_writing {

inline void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>(value >> (8 * i) & 0xFF);
}

inline std::string item(const std::string& key, char type, std::size_t sample_bytes, std::size_t samples,
                        const std::string& bytes) {
  std::string out = key;
  out += type;
  put(out, sample_bytes, 1);
  put(out, samples, 2);
  out += bytes;
  out.append((4 - bytes.size() % 4) % 4, '\0');
  return out;
}
inline std::string nest(const std::string& key, const std::string& inside) {
  return item(key, '\0', 4, inside.size() / 4, inside);
}
inline std::string text(const std::string& key, const std::string& words) {
  return item(key, 'c', 1, words.size(), words);
}
inline std::string u32(const std::string& key, std::uint32_t value) {
  std::string b;
  put(b, value, 4);
  return item(key, 'L', 4, 1, b);
}
inline std::string u64(const std::string& key, std::uint64_t value) {
  std::string b;
  put(b, value, 8);
  return item(key, 'J', 8, 1, b);
}
inline std::string s16(const std::string& key, std::size_t columns, const std::vector<std::int16_t>& values) {
  std::string b;
  for (const std::int16_t v : values) put(b, static_cast<std::uint16_t>(v), 2);
  return item(key, 's', 2 * columns, values.size() / columns, b);
}
inline std::string f32(const std::string& key, std::size_t columns, const std::vector<float>& values) {
  std::string b;
  for (const float v : values) put(b, std::bit_cast<std::uint32_t>(v), 4);
  return item(key, 'f', 4 * columns, values.size() / columns, b);
}
inline std::span<const std::byte> bytes_of(const std::string& s) {
  return std::as_bytes(std::span(s));
}

}  // namespace takt::gpmf_writing
