// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace takt {

/// Reads little-endian fields one after the other. Past the end everything is 0 and `good()` is false: check once.
class ByteCursor {
 public:
  explicit ByteCursor(std::span<const std::byte> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - place_; }
  [[nodiscard]] std::size_t place() const { return place_; }

  std::uint8_t u8() { return number<std::uint8_t>(); }
  std::uint16_t u16() { return number<std::uint16_t>(); }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  std::uint64_t u64() { return number<std::uint64_t>(); }
  double f64() { return std::bit_cast<double>(number<std::uint64_t>()); }

  std::span<const std::byte> bytes(std::uint64_t count) {
    if (count > left()) {
      good_ = false;
      place_ = bytes_.size();
      return {};
    }
    const auto out = bytes_.subspan(place_, static_cast<std::size_t>(count));
    place_ += out.size();
    return out;
  }
  std::string_view text(std::uint64_t count) {
    const auto b = bytes(count);
    return {reinterpret_cast<const char*>(b.data()), b.size()};
  }

 private:
  template <class T>
  T number() {
    static_assert(std::endian::native == std::endian::little);
    T value{};
    const auto b = bytes(sizeof(T));
    if (!b.empty()) std::memcpy(&value, b.data(), sizeof(T));
    return value;
  }

  std::span<const std::byte> bytes_;
  std::size_t place_ = 0;
  bool good_ = true;
};

}  // namespace takt
