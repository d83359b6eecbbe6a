// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/byte_window.h"
#include "takt/recording/chunk_ahead.h"
#include "takt/recording/decompress.h"
#include "takt/recording/files.h"
#include "takt/recording/message_file.h"

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
/// A time's eight bytes; false where it does not fit into them (0 to 2³² s).
[[nodiscard]] bool put_time(std::span<std::byte> out, Stamp time);

using Connections = std::map<std::uint32_t, Channel>;
/// A connection's type stands among the fields of its data. The first record of an id counts.
bool learn_connection(const Header& header, std::span<const std::byte> data, Connections& connections);

/// A record in the file: its header, and where its data is.
struct Record {
  Header header;
  std::vector<std::byte> header_bytes;  ///< what the header's views look at
  std::uint64_t data_at = 0;
  std::uint32_t data_size = 0;

  [[nodiscard]] std::uint64_t end() const { return data_at + data_size; }
};
enum class Found { record, cut_off, broken };
/// A record that is cut off in its data is read as far as its header goes.
[[nodiscard]] Found read_record(const ByteSource& file, std::uint64_t at, Record& out);
[[nodiscard]] std::optional<std::vector<std::byte>> read_data(const ByteSource& file, const Record& record);

/// The records of a chunk, decompressed; nothing where it is broken or beyond half a gigabyte.
[[nodiscard]] std::optional<std::vector<std::byte>> read_chunk(const ByteSource& file, const Record& record);
/// The same into memory that is used again; false where they are broken.
[[nodiscard]] bool load_chunk(const ByteSource& file, const Record& record, ChunkBuffer& into);
/// What can be had of a chunk whose data is broken or reaches beyond the file's end.
[[nodiscard]] std::vector<std::byte> read_part_of_chunk(const ByteSource& file, const Record& record);

/// The first byte from `at` on that is not zero, or the file's size. A record never starts with a zero byte, because
/// its header has a length.
[[nodiscard]] std::uint64_t after_zeros(const ByteSource& file, std::uint64_t at);

/// What stands at the end of a bag that was closed: every connection, and for every chunk which of them it holds.
struct Index {
  Connections connections;
  std::map<std::uint64_t, std::vector<std::uint32_t>> chunks;  ///< place of the chunk -> its connections
};
/// Nothing where the bag has no index, or a broken one.
[[nodiscard]] std::optional<Index> read_index(const ByteSource& file);

}  // namespace takt::ros1
