// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/files.h"

namespace takt {

enum class Compression { none, lz4, bz2, zstd };
/// "", "none", "lz4", "bz2", "zstd"; nothing for another word.
[[nodiscard]] std::optional<Compression> compression_named(std::string_view name);

/// Nothing where the input is broken or does not give exactly `size` bytes. Memory grows with what is really there, so
/// a false claim of size costs nothing.
[[nodiscard]] std::optional<std::vector<std::byte>> decompress(Compression kind, std::span<const std::byte> input,
                                                               std::size_t size);
/// The same again and again, without new memory: contexts are kept, and the buffer only ever grows.
class Decompressor {
 public:
  Decompressor();
  ~Decompressor();
  /// The first `size` bytes of `out`; false where the input is broken.
  [[nodiscard]] bool run(Compression kind, std::span<const std::byte> input, std::size_t size,
                         std::vector<std::byte>& out);

 private:
  struct Contexts;
  std::unique_ptr<Contexts> contexts_;
};

/// As far as it goes, and at most `most` bytes: of an input that is cut off or broken.
[[nodiscard]] std::vector<std::byte> decompress_part(Compression kind, std::span<const std::byte> input,
                                                     std::size_t most);

/// LZ4 and zstd frames, bzip2 streams, in the variants that ROS and MCAP readers take.
[[nodiscard]] std::vector<std::byte> compress(Compression kind, std::span<const std::byte> input);

/// A zstd file, piece by piece, whatever its size. False where it is broken or `put` says no.
[[nodiscard]] bool decompress_zstd_file(const ByteSource& file,
                                        const std::function<bool(std::span<const std::byte>)>& put);

}  // namespace takt
