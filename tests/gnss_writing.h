// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fmt/core.h>

#include <array>
#include <cstdint>
#include <string>

/// Sentences and UBX messages as a receiver writes them, byte for byte: written here from the interface description,
/// not with the code under test.
namespace takt::gnss_writing {

inline std::string sentence(const std::string& body) {
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  return fmt::format("${}*{:02X}\r\n", body, sum);
}

template <class T>
std::string little(T value, std::size_t bytes) {
  std::string out;
  auto v = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < bytes; ++i, v >>= 8) out += static_cast<char>(v & 0xff);
  return out;
}

inline std::string ubx(int message_class, int id, const std::string& payload) {
  const std::string body = little(message_class, 1) + little(id, 1) + little(payload.size(), 2) + payload;
  unsigned a = 0, b = 0;
  for (const char c : body) {
    a = (a + static_cast<unsigned char>(c)) & 0xff;
    b = (b + a) & 0xff;
  }
  return "\xb5\x62" + body + little(a, 1) + little(b, 1);
}

using Date = std::array<int, 6>;  // year … second

inline std::string nav_pvt(const Date& d, std::uint32_t itow_ms, std::int32_t nano, int valid) {
  return ubx(1, 7,
             little(itow_ms, 4) + little(d[0], 2) + little(d[1], 1) + little(d[2], 1) + little(d[3], 1) +
                 little(d[4], 1) + little(d[5], 1) + little(valid, 1) + little(20, 4) + little(nano, 4) +
                 std::string(72, '\0'));
}
inline std::string nav_timegps(std::uint32_t itow_ms, std::int32_t nano, int week, int leap, int valid) {
  return ubx(
      1, 0x20,
      little(itow_ms, 4) + little(nano, 4) + little(week, 2) + little(leap, 1) + little(valid, 1) + little(9, 4));
}
inline std::string nav_timels(std::uint32_t itow_ms, int current, int change, std::int32_t to_event, int valid) {
  return ubx(1, 0x26,
             little(itow_ms, 4) + std::string(4, '\0') + little(2, 1) + little(current, 1) + little(2, 1) +
                 little(change, 1) + little(to_event, 4) + std::string(7, '\0') + little(valid, 1));
}
inline std::string tim_tp(std::uint32_t tow_ms, std::uint32_t sub, std::int32_t error_ps, int week, int flags) {
  return ubx(
      0x0d, 1,
      little(tow_ms, 4) + little(sub, 4) + little(error_ps, 4) + little(week, 2) + little(flags, 1) + little(0, 1));
}
inline std::string tim_tm2(int flags, int count, int week, std::uint32_t tow_ms, std::uint32_t sub_ns) {
  return ubx(0x0d, 3,
             little(0, 1) + little(flags, 1) + little(count, 2) + little(week, 2) + little(week, 2) +
                 little(tow_ms, 4) + little(sub_ns, 4) + little(tow_ms + 1, 4) + little(sub_ns, 4) + little(25, 4));
}

/// Both edges of one event, on GPS time; 0 where an edge is not told.
inline std::string tim_tm2(int count, std::int64_t rising_ns, std::int64_t falling_ns, unsigned accuracy_ns) {
  constexpr std::int64_t week_ns = 604'800'000'000'000;
  const int flags = 0x48 | (rising_ns != 0 ? 0x80 : 0) | (falling_ns != 0 ? 0x04 : 0);
  const auto tow = [&](std::int64_t ns) { return little(ns % week_ns / 1'000'000, 4) + little(ns % 1'000'000, 4); };
  return ubx(0x0d, 3,
             little(0, 1) + little(flags, 1) + little(count, 2) + little(rising_ns / week_ns, 2) +
                 little(falling_ns / week_ns, 2) + tow(rising_ns) + tow(falling_ns) + little(accuracy_ns, 4));
}

}  // namespace takt::gnss_writing
