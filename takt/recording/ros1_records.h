// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "takt/recording/byte_cursor.h"
#include "takt/recording/byte_window.h"
#include "takt/recording/record_format.h"

/// The records of ROS 1 bags, format 2.0: a header of `name=value` fields, and data.
/// http://wiki.ros.org/Bags/Format/2.0
namespace takt::ros1 {

constexpr std::string_view magic = "#ROSBAG V2.0\n";

enum class Op : std::uint8_t { none = 0, message = 2, bag = 3, index = 4, chunk = 5, chunk_info = 6, connection = 7 };

/// The fields of a record's header that matter here. A field that is absent stays empty. The texts are views of the
/// header's bytes.
struct Header {
  Op op = Op::none;
  std::optional<std::uint32_t> connection;
  std::optional<std::uint32_t> size;   ///< of a chunk, decompressed
  std::optional<std::uint64_t> place;  ///< index_pos of the bag, chunk_pos of a chunk's info
  std::optional<Stamp> time, start_time, end_time;
  std::string_view topic, type, compression, definition;
  /// Where the values of these fields begin in the header's bytes; 0 where there are none.
  std::size_t place_at = 0, time_at = 0, start_time_at = 0, end_time_at = 0;
};

/// `name=value` fields, each after its length. False where they do not fill the bytes exactly.
[[nodiscard]] bool read_fields(std::span<const std::byte> bytes, Header& header);
/// Seconds and nanoseconds.
[[nodiscard]] Stamp read_time(ByteCursor& in);
/// A time's eight bytes; false where it does not fit into them (0 to 2³² s).
[[nodiscard]] bool put_time(std::span<std::byte> out, Stamp time);

/// A connection's type stands among the fields of its data; false where the record is broken.
[[nodiscard]] bool learn(const Header& header, std::span<const std::byte> data, KnownChannels& known);

/// A record: its header, and where its data is.
struct Record {
  Header header;                            ///< its texts are valid until the next look through the window
  std::span<const std::byte> header_bytes;  ///< likewise
  std::uint64_t data_at = 0;
  std::uint32_t data_size = 0;

  [[nodiscard]] std::uint64_t end() const { return data_at + data_size; }
};
enum class Found { record, cut_off, broken };
/// A record whose data is cut off is found. Its header is there in full.
[[nodiscard]] Found head_at(ByteWindow& bytes, std::uint64_t at, Record& out);

}  // namespace takt::ros1
