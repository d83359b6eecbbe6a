// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

/// Files as bytes, with errors that say what to try.
namespace takt {

/// The whole file. Copied rather than mapped: a log that is still being written, or cut meanwhile, must not kill us.
/// Throws takt::Error when it cannot be read.
[[nodiscard]] std::string read_file(const std::string& path);

/// Up to `count` first bytes; empty where the file cannot be read.
[[nodiscard]] std::string file_head(const std::string& path, std::size_t count);

/// Bytes with random access: a file, or memory in tests and under the fuzzer.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Fills `out` from `offset`; false when fewer bytes are there.
  [[nodiscard]] virtual bool read(std::uint64_t offset, std::span<std::byte> out) const = 0;
};

/// Throws takt::Error when the file cannot be opened. Reading is thread-safe.
[[nodiscard]] std::shared_ptr<const ByteSource> open_bytes(const std::string& path);
/// A view of memory that outlives the source.
[[nodiscard]] std::shared_ptr<const ByteSource> view_bytes(std::span<const std::byte> bytes);

}  // namespace takt
