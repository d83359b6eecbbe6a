// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "takt/recording/message_file.h"
#include "takt/time/instant.h"

namespace takt {

/// Reads the fields of a ROS message one after the other, in ROS 1's serialization or in DDS's CDR (RTPS 2.3 §10,
/// XTypes 1.3 §7.4): there numbers are aligned, texts end in a zero byte, and the first four bytes say which byte order
/// it is. Past the end everything is 0 and `good()` is false: check once.
class MessageReader {
 public:
  MessageReader(MessageEncoding encoding, std::span<const std::byte> bytes);

  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t place() const { return place_; }
  [[nodiscard]] bool is_cdr() const { return cdr_; }
  [[nodiscard]] bool big_endian() const { return big_endian_; }

  std::uint8_t u8();
  std::uint32_t u32();
  double f64();
  std::string_view text();
  std::span<const std::byte> bytes();                     ///< a uint8[]
  std::span<const std::byte> bytes(std::uint64_t count);  ///< as they stand
  void skip_f64(std::uint64_t count);
  /// std_msgs/Header, whose stamp it gives. Nothing where the stamp is none.
  std::optional<Stamp> header();
  /// Where the stamp's eight bytes are, with the reader at the message's beginning.
  [[nodiscard]] std::optional<std::size_t> stamp_place();

 private:
  void align(std::size_t to);
  std::uint64_t number(std::size_t size);

  std::span<const std::byte> bytes_;
  std::size_t place_ = 0;
  std::size_t origin_ = 0;      // what alignment counts from
  std::size_t most_align_ = 8;  // 4 in the second version of CDR
  bool cdr_ = false;
  bool big_endian_ = false;
  bool good_ = true;
};

/// Writes `stamp` over the header's stamp of a message in ROS 1's serialization or CDR. False where the message has
/// no header or the stamp does not fit (ROS 1: 0 to 2³² s; ROS 2: ±2³¹ s).
[[nodiscard]] bool overwrite_stamp(MessageEncoding encoding, std::span<std::byte> message, Stamp stamp);
/// The header's stamp.
[[nodiscard]] std::optional<Stamp> header_stamp(MessageEncoding encoding, std::span<const std::byte> message);

/// The channel's messages begin with a std_msgs/Header: as their definition says, or since their type is known to.
[[nodiscard]] bool begins_with_header(const Channel& channel);

}  // namespace takt
