// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/decompress.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace takt {

namespace {

using Bytes = std::vector<std::byte>;
constexpr std::size_t step_bytes = 1U << 20;

/// What came out, and whether the input came to its proper end.
struct Outcome {
  Bytes bytes;
  bool ended = false;
};

/// Room for at least one more byte, if `most` is not reached yet.
void grow(Bytes& out, std::size_t filled, std::size_t most) {
  if (filled == out.size()) out.resize(std::min(most, std::max(2 * filled, std::min(most, step_bytes))));
}

Outcome from_lz4(std::span<const std::byte> frame, std::size_t most) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) return {};
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw,
                                                                                     &LZ4F_freeDecompressionContext);
  Outcome out;
  std::size_t filled = 0, used = 0;
  while (true) {
    grow(out.bytes, filled, most);
    std::size_t room = out.bytes.size() - filled, taken = frame.size() - used;
    const std::size_t hint =
        LZ4F_decompress(context.get(), out.bytes.data() + filled, &room, frame.data() + used, &taken, nullptr);
    if (LZ4F_isError(hint)) break;
    filled += room;
    used += taken;
    out.ended = hint == 0;
    if (out.ended || (room == 0 && taken == 0)) break;  // the end, cut off, or longer than it claims
  }
  out.bytes.resize(filled);
  return out;
}

Outcome from_bz2(std::span<const std::byte> stream, std::size_t most) {
  bz_stream state{};
  if (BZ2_bzDecompressInit(&state, 0, 0) != BZ_OK) return {};
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> release(&state, &BZ2_bzDecompressEnd);
  state.next_in = const_cast<char*>(reinterpret_cast<const char*>(stream.data()));
  state.avail_in = static_cast<unsigned>(stream.size());

  Outcome out;
  std::size_t filled = 0;
  while (true) {
    grow(out.bytes, filled, most);
    const std::size_t room = out.bytes.size() - filled;
    const unsigned before = state.avail_in;
    state.next_out = reinterpret_cast<char*>(out.bytes.data()) + filled;
    state.avail_out = static_cast<unsigned>(room);
    const int result = BZ2_bzDecompress(&state);
    const std::size_t got = room - state.avail_out;
    filled += got;
    out.ended = result == BZ_STREAM_END;
    if (result != BZ_OK || (got == 0 && state.avail_in == before)) break;
  }
  out.bytes.resize(filled);
  return out;
}

using ZstdStream = std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)>;

Outcome from_zstd(std::span<const std::byte> frame, std::size_t most) {
  const ZstdStream stream(ZSTD_createDStream(), &ZSTD_freeDStream);
  if (!stream) return {};
  Outcome out;
  ZSTD_inBuffer in{frame.data(), frame.size(), 0};
  std::size_t filled = 0;
  while (true) {
    grow(out.bytes, filled, most);
    ZSTD_outBuffer part{out.bytes.data() + filled, out.bytes.size() - filled, 0};
    const std::size_t before = in.pos;
    const std::size_t hint = ZSTD_decompressStream(stream.get(), &part, &in);
    if (ZSTD_isError(hint)) break;
    filled += part.pos;
    out.ended = hint == 0;
    if ((out.ended && in.pos == in.size) || (part.pos == 0 && in.pos == before)) break;
  }
  out.bytes.resize(filled);
  return out;
}

Outcome run(Compression kind, std::span<const std::byte> input, std::size_t most) {
  switch (kind) {
    case Compression::none:
      break;
    case Compression::lz4:
      return from_lz4(input, most);
    case Compression::bz2:
      return from_bz2(input, most);
    case Compression::zstd:
      return from_zstd(input, most);
  }
  const auto part = input.first(std::min(input.size(), most));
  return {Bytes(part.begin(), part.end()), part.size() == input.size()};
}

Bytes to_lz4(std::span<const std::byte> input) {
  LZ4F_preferences_t like_ros{};  // roslz4 takes independent blocks with a checksum of the content, nothing else
  like_ros.frameInfo.blockMode = LZ4F_blockIndependent;
  like_ros.frameInfo.blockSizeID = LZ4F_max4MB;
  like_ros.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  Bytes out(LZ4F_compressFrameBound(input.size(), &like_ros));
  const std::size_t size = LZ4F_compressFrame(out.data(), out.size(), input.data(), input.size(), &like_ros);
  if (LZ4F_isError(size)) throw std::runtime_error(std::string("lz4: ") + LZ4F_getErrorName(size));
  out.resize(size);
  return out;
}

Bytes to_bz2(std::span<const std::byte> input) {
  Bytes out(input.size() + input.size() / 100 + 600);
  auto size = static_cast<unsigned>(out.size());
  const int result = BZ2_bzBuffToBuffCompress(reinterpret_cast<char*>(out.data()), &size,
                                              const_cast<char*>(reinterpret_cast<const char*>(input.data())),
                                              static_cast<unsigned>(input.size()), 9, 0, 30);
  if (result != BZ_OK) throw std::runtime_error("bzip2: compression failed");
  out.resize(size);
  return out;
}

Bytes to_zstd(std::span<const std::byte> input) {
  Bytes out(ZSTD_compressBound(input.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), input.data(), input.size(), 1);
  if (ZSTD_isError(size)) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

}  // namespace

std::optional<Compression> compression_named(std::string_view name) {
  if (name.empty() || name == "none") return Compression::none;
  if (name == "lz4") return Compression::lz4;
  if (name == "bz2") return Compression::bz2;
  if (name == "zstd") return Compression::zstd;
  return std::nullopt;
}

std::optional<Bytes> decompress(Compression kind, std::span<const std::byte> input, std::size_t size) {
  Outcome out = run(kind, input, size);
  if (!out.ended || out.bytes.size() != size) return std::nullopt;
  return std::move(out.bytes);
}

Bytes decompress_part(Compression kind, std::span<const std::byte> input, std::size_t most) {
  return run(kind, input, most).bytes;
}

Bytes compress(Compression kind, std::span<const std::byte> input) {
  switch (kind) {
    case Compression::none:
      break;
    case Compression::lz4:
      return to_lz4(input);
    case Compression::bz2:
      return to_bz2(input);
    case Compression::zstd:
      return to_zstd(input);
  }
  return {input.begin(), input.end()};
}

bool decompress_zstd_file(const ByteSource& file, const std::function<bool(std::span<const std::byte>)>& put) {
  const ZstdStream stream(ZSTD_createDStream(), &ZSTD_freeDStream);
  Bytes block(step_bytes), piece(step_bytes);
  std::size_t hint = 1;
  for (std::uint64_t at = 0; at < file.size(); at += block.size()) {
    block.resize(static_cast<std::size_t>(std::min<std::uint64_t>(step_bytes, file.size() - at)));
    if (!file.read(at, block)) return false;
    ZSTD_inBuffer in{block.data(), block.size(), 0};
    ZSTD_outBuffer out{};
    do {
      out = {piece.data(), piece.size(), 0};
      hint = ZSTD_decompressStream(stream.get(), &out, &in);
      if (ZSTD_isError(hint) || !put(std::span<const std::byte>(piece).first(out.pos))) return false;
    } while (in.pos < in.size || (hint != 0 && out.pos == out.size));
  }
  return hint == 0;
}

}  // namespace takt
