// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace takt {

/// Nothing where the input is broken or does not give exactly `size` bytes. Memory grows with what is really there, so
/// a false claim of size costs nothing.
[[nodiscard]] std::optional<std::vector<std::byte>> decompress_lz4(std::span<const std::byte> frame, std::size_t size);
[[nodiscard]] std::optional<std::vector<std::byte>> decompress_bz2(std::span<const std::byte> stream, std::size_t size);

}  // namespace takt
