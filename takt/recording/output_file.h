// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "takt/recording/files.h"

namespace takt {

/// A file while it is written, buffered. Without a path nothing is written and only places are counted: a rehearsal.
/// All throw takt::Error where the disk does not take it.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(const std::string& text) { write(std::as_bytes(std::span(text))); }
  /// A part of another file, as it is.
  void copy(const ByteSource& from, std::uint64_t at, std::uint64_t count);
  /// Over what was written before.
  void patch(std::uint64_t place, std::span<const std::byte> bytes);
  /// Where the next byte goes.
  [[nodiscard]] std::uint64_t place() const { return place_; }
  /// To the disk itself, so that a power cut after a rename finds the content there.
  void finish();

  /// CRC-32 (IEEE 802.3) of all bytes written since this was called.
  void start_crc();
  [[nodiscard]] std::uint32_t crc() const { return crc_; }

 private:
  void flush();
  [[noreturn]] void fail() const;

  std::string path_;
  int handle_ = -1;
  std::vector<std::byte> buffer_;
  std::uint64_t place_ = 0;
  std::uint32_t crc_ = 0;
  bool counts_crc_ = false;
};

[[nodiscard]] std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t before = 0);

/// Gives a finished file or folder its final name, at once and for good: readers see what was there before or all of
/// the new. Throws takt::Error.
void publish(const std::string& temporary, const std::string& final_name);

}  // namespace takt
