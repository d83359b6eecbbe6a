// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/decompress.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>

namespace takt {

namespace {

using Bytes = std::vector<std::byte>;
constexpr std::size_t step_bytes = 1U << 20;

/// How much came out, and whether the input came to its proper end.
struct Outcome {
  std::size_t filled = 0;
  bool ended = false;
};

/// Room behind `filled`, of `most` bytes in all. The buffer grows with what comes out of the input, not with what the
/// input claims, and never shrinks: what is used again needs no new memory.
std::span<std::byte> room_in(Bytes& out, std::size_t filled, std::size_t most) {
  if (filled >= out.size() && out.size() < most)
    out.resize(std::min(most, std::max(2 * filled, std::min(most, step_bytes))));
  return std::span(out).first(std::min(out.size(), most)).subspan(filled);
}

using Lz4Context = std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)>;
using ZstdStream = std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)>;

Lz4Context lz4_context() {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) throw std::bad_alloc();
  return {raw, &LZ4F_freeDecompressionContext};
}
ZstdStream zstd_stream() {
  ZstdStream stream(ZSTD_createDStream(), &ZSTD_freeDStream);
  if (!stream) throw std::bad_alloc();
  return stream;
}

Outcome from_lz4(LZ4F_dctx& context, std::span<const std::byte> frame, std::size_t most, Bytes& bytes) {
  LZ4F_resetDecompressionContext(&context);
  Outcome out;
  for (std::size_t used = 0; !out.ended;) {
    const auto free = room_in(bytes, out.filled, most);
    std::size_t room = free.size(), taken = frame.size() - used;
    const std::size_t hint = LZ4F_decompress(&context, free.data(), &room, frame.data() + used, &taken, nullptr);
    if (LZ4F_isError(hint)) break;
    out.filled += room;
    used += taken;
    out.ended = hint == 0;
    if (room == 0 && taken == 0) break;  // cut off, or longer than it claims
  }
  return out;
}

Outcome from_bz2(std::span<const std::byte> stream, std::size_t most, Bytes& bytes) {
  bz_stream state{};
  if (BZ2_bzDecompressInit(&state, 0, 0) != BZ_OK) return {};
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> release(&state, &BZ2_bzDecompressEnd);
  state.next_in = const_cast<char*>(reinterpret_cast<const char*>(stream.data()));
  state.avail_in = static_cast<unsigned>(stream.size());

  Outcome out;
  while (!out.ended) {
    const auto free = room_in(bytes, out.filled, most);
    const unsigned before = state.avail_in;
    state.next_out = reinterpret_cast<char*>(free.data());
    state.avail_out = static_cast<unsigned>(free.size());
    const int result = BZ2_bzDecompress(&state);
    const std::size_t got = free.size() - state.avail_out;
    out.filled += got;
    out.ended = result == BZ_STREAM_END;
    if (result != BZ_OK || (got == 0 && state.avail_in == before)) break;
  }
  return out;
}

Outcome from_zstd(ZSTD_DStream& stream, std::span<const std::byte> frame, std::size_t most, Bytes& bytes) {
  ZSTD_DCtx_reset(&stream, ZSTD_reset_session_only);
  Outcome out;
  ZSTD_inBuffer in{frame.data(), frame.size(), 0};
  while (true) {
    const auto free = room_in(bytes, out.filled, most);
    ZSTD_outBuffer part{free.data(), free.size(), 0};
    const std::size_t before = in.pos;
    const std::size_t hint = ZSTD_decompressStream(&stream, &part, &in);
    if (ZSTD_isError(hint)) break;
    out.filled += part.pos;
    out.ended = hint == 0;
    if ((out.ended && in.pos == in.size) || (part.pos == 0 && in.pos == before)) break;
  }
  return out;
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

namespace {

/// Each is made when it is first needed.
struct AllContexts {
  std::optional<Lz4Context> lz4;
  std::optional<ZstdStream> zstd;

  Outcome run(Compression kind, std::span<const std::byte> input, std::size_t most, Bytes& out) {
    switch (kind) {
      case Compression::none:
        break;
      case Compression::lz4:
        if (!lz4) lz4 = lz4_context();
        return from_lz4(**lz4, input, most, out);
      case Compression::bz2:
        return from_bz2(input, most, out);
      case Compression::zstd:
        if (!zstd) zstd = zstd_stream();
        return from_zstd(**zstd, input, most, out);
    }
    const auto part = input.first(std::min(input.size(), most));
    out.assign(part.begin(), part.end());
    return {part.size(), part.size() == input.size()};
  }
};

}  // namespace

struct Decompressor::Contexts : AllContexts {};

Decompressor::Decompressor() : contexts_(std::make_unique<Contexts>()) {}
Decompressor::~Decompressor() = default;

bool Decompressor::run(Compression kind, std::span<const std::byte> input, std::size_t size, Bytes& out) {
  const Outcome done = contexts_->run(kind, input, size, out);
  return done.ended && done.filled == size;
}

std::optional<Bytes> decompress(Compression kind, std::span<const std::byte> input, std::size_t size) {
  Bytes out;
  if (!Decompressor().run(kind, input, size, out)) return std::nullopt;
  out.resize(size);
  return out;
}

Bytes decompress_part(Compression kind, std::span<const std::byte> input, std::size_t most) {
  Bytes out;
  out.resize(AllContexts().run(kind, input, most, out).filled);
  return out;
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
  const ZstdStream stream = zstd_stream();
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
