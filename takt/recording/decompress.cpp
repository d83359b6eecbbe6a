// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/decompress.h"

#include <bzlib.h>
#include <lz4frame.h>

#include <algorithm>
#include <memory>

namespace takt {

namespace {

constexpr std::size_t step_bytes = 1U << 20;

/// Room for at least one more byte, if `size` is not reached yet.
void grow(std::vector<std::byte>& out, std::size_t filled, std::size_t size) {
  if (filled == out.size()) out.resize(std::min(size, std::max(2 * filled, std::min(size, step_bytes))));
}

}  // namespace

std::optional<std::vector<std::byte>> decompress_lz4(std::span<const std::byte> frame, std::size_t size) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) return std::nullopt;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw,
                                                                                     &LZ4F_freeDecompressionContext);
  std::vector<std::byte> out;
  std::size_t filled = 0, used = 0;
  while (true) {
    grow(out, filled, size);
    std::size_t room = out.size() - filled, taken = frame.size() - used;
    const std::size_t hint =
        LZ4F_decompress(context.get(), out.data() + filled, &room, frame.data() + used, &taken, nullptr);
    if (LZ4F_isError(hint)) return std::nullopt;
    filled += room;
    used += taken;
    if (hint == 0) break;
    if (room == 0 && taken == 0) return std::nullopt;  // cut off, or longer than it claims
  }
  if (filled != size) return std::nullopt;
  return out;
}

std::optional<std::vector<std::byte>> decompress_bz2(std::span<const std::byte> stream, std::size_t size) {
  bz_stream state{};
  if (BZ2_bzDecompressInit(&state, 0, 0) != BZ_OK) return std::nullopt;
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> release(&state, &BZ2_bzDecompressEnd);
  state.next_in = const_cast<char*>(reinterpret_cast<const char*>(stream.data()));
  state.avail_in = static_cast<unsigned>(stream.size());

  std::vector<std::byte> out;
  std::size_t filled = 0;
  while (true) {
    grow(out, filled, size);
    const std::size_t room = out.size() - filled;
    const unsigned before = state.avail_in;
    state.next_out = reinterpret_cast<char*>(out.data()) + filled;
    state.avail_out = static_cast<unsigned>(room);
    const int result = BZ2_bzDecompress(&state);
    const std::size_t got = room - state.avail_out;
    filled += got;
    if (result == BZ_STREAM_END) break;
    if (result != BZ_OK || (got == 0 && state.avail_in == before)) return std::nullopt;
  }
  if (filled != size) return std::nullopt;
  return out;
}

}  // namespace takt
