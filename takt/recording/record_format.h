// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/recording/byte_window.h"
#include "takt/recording/decompress.h"
#include "takt/recording/message_file.h"

/// What ROS 1 bags and MCAP files have in common: records one after the other, and chunks of records.
namespace takt {

/// A chunk's records as they are stored.
struct StoredRecords {
  Compression compression = Compression::none;
  std::uint64_t at = 0, size = 0;  ///< in the file
  std::uint64_t plain_size = 0;
  std::uint32_t crc = 0;  ///< CRC-32 of the records; 0: not given
};

struct FileRecord {
  enum class Kind {
    other,
    unknown,  ///< to the format as we know it
    zeros,    ///< no record: what crashed recorders leave behind
    channel,
    message,
    chunk,
    index,  ///< of one channel's messages in the chunk before
    end     ///< of all data
  };
  Kind kind = Kind::other;
  bool broken = false;   ///< its inner and outer lengths contradict each other, or what it has to say is missing
  bool certain = false;  ///< its lengths agree so well that chance could not have made it
  std::uint64_t at = 0, end = 0;
  std::uint64_t data_at = 0;  ///< of a message's bytes, which reach to `end`
  std::uint32_t channel = 0;  ///< of a message or an index
  std::uint64_t count = 0;    ///< of an index's messages
  Stamp recorded{};           ///< of a message
  StoredRecords records;      ///< of a chunk
};

/// The channels that are known while records go by, and the schemas of a format that keeps them apart.
struct KnownChannels {
  struct Schema {
    std::string name, encoding, definition;
  };
  std::map<std::uint32_t, Channel> channels;  ///< by the file's own numbers
  std::map<std::uint32_t, Schema> schemas;
};

/// What stands at the end of a file that was closed.
struct FileIndex {
  KnownChannels known;
  std::map<std::uint64_t, std::vector<std::uint32_t>> chunks;  ///< place of a chunk -> channels in it
};

/// How the records of one kind of file are laid out. All else is the same for all of them: `ChunkedFile`.
class RecordFormat {
 public:
  virtual ~RecordFormat() = default;
  [[nodiscard]] virtual std::uint64_t first_record() const = 0;
  /// The record that begins there; it may reach beyond the end. Nothing where none can begin.
  [[nodiscard]] virtual std::optional<FileRecord> record_at(ByteWindow& bytes, std::uint64_t at) const = 0;
  /// The first place from `from` on where a record might begin, for a search behind damage: cheap and not sure.
  [[nodiscard]] virtual std::optional<std::uint64_t> candidate(ByteWindow& bytes, std::uint64_t from) const = 0;
  /// False where a channel's record is broken. The first record of a number counts.
  virtual bool learn(ByteWindow& bytes, const FileRecord& record, KnownChannels& known) const = 0;
  /// Nothing where there is none, or a broken one.
  [[nodiscard]] virtual std::optional<FileIndex> read_index(const ByteSource& file) const = 0;
  /// Appends the times in an index of one channel's messages.
  virtual void read_times(ByteWindow& bytes, const FileRecord& index, std::vector<Stamp>& times) const = 0;
  /// A file that was closed has a record of kind `end`.
  [[nodiscard]] virtual bool has_end_record() const = 0;
};

/// The memory for a chunk while it is read and decompressed, used again for the next one.
struct ChunkBuffer {
  Decompressor decompressor;
  std::vector<std::byte> stored, plain;
  std::size_t size = 0;  ///< of the records, the first bytes of `plain`

  [[nodiscard]] std::span<const std::byte> records() const { return std::span(plain).first(size); }
};
/// False where they are broken, too many, or do not have their checksum.
[[nodiscard]] bool load_records(const ByteSource& file, const StoredRecords& records, ChunkBuffer& into);
/// What can be had of records that are broken or cut off.
[[nodiscard]] std::vector<std::byte> load_part(const ByteSource& file, const StoredRecords& records);

}  // namespace takt
