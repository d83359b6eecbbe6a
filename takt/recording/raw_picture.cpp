// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/raw_picture.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace takt {

namespace {

enum class Kind { gray, rgb, bayer, luma };

struct Encoding {
  std::string_view name;
  Kind kind;
  std::uint32_t bytes;         ///< a pixel
  std::array<int, 3> r_g_b{};  ///< byte of each colour; luma: its byte comes first
};

constexpr std::array<Encoding, 14> encodings{{
    {"mono8", Kind::gray, 1, {}},
    {"8UC1", Kind::gray, 1, {}},
    {"rgb8", Kind::rgb, 3, {0, 1, 2}},
    {"bgr8", Kind::rgb, 3, {2, 1, 0}},
    {"8UC3", Kind::rgb, 3, {2, 1, 0}},
    {"rgba8", Kind::rgb, 4, {0, 1, 2}},
    {"bgra8", Kind::rgb, 4, {2, 1, 0}},
    {"bayer_rggb8", Kind::bayer, 1, {}},
    {"bayer_bggr8", Kind::bayer, 1, {}},
    {"bayer_gbrg8", Kind::bayer, 1, {}},
    {"bayer_grbg8", Kind::bayer, 1, {}},
    {"yuv422", Kind::luma, 2, {1, 0, 0}},
    {"uyvy", Kind::luma, 2, {1, 0, 0}},
    {"yuv422_yuy2", Kind::luma, 2, {0, 0, 0}},
}};

const Encoding* find_encoding(std::string_view name) {
  const auto found =
      std::find_if(encodings.begin(), encodings.end(), [&](const Encoding& e) { return e.name == name; });
  return found == encodings.end() ? nullptr : &*found;
}

/// "mono16" -> "mono8"; empty where the encoding has no values of two bytes.
std::string of_one_byte(std::string_view name) {
  if (!name.ends_with("16")) return {};
  const std::string out = std::string(name.substr(0, name.size() - 2)) + "8";
  return find_encoding(out) ? out : std::string{};
}

using Pixels = std::vector<std::uint8_t>;

/// How far 8 bits have to be moved up to hold the value, in the steps that sensors have.
int shift_for(std::uint16_t largest) {
  int shift = 0;
  while (largest >> shift > 255) shift += 2;
  return shift;
}

GrayImage to_gray_from_two_bytes(const RawPicture& p, const std::string& encoding) {
  const Encoding& e = *find_encoding(encoding);
  const std::uint64_t values = std::uint64_t{p.width} * e.bytes;
  if (p.height == 0 || p.stride < 2 * values || std::uint64_t{p.stride} * (p.height - 1) + 2 * values > p.pixels.size())
    return {};
  const auto value = [&](std::uint32_t y, std::uint64_t i) {
    const std::byte* const at = p.pixels.data() + static_cast<std::size_t>(std::uint64_t{y} * p.stride + 2 * i);
    const auto low = static_cast<unsigned>(at[p.big_endian ? 1 : 0]),
               high = static_cast<unsigned>(at[p.big_endian ? 0 : 1]);
    return static_cast<std::uint16_t>(high << 8 | low);
  };
  std::uint16_t largest = 0;
  for (std::uint32_t y = 0; y < p.height; ++y)
    for (std::uint64_t i = 0; i < values; ++i) largest = std::max(largest, value(y, i));
  const int shift = shift_for(largest);
  auto bytes = std::make_shared<std::vector<std::byte>>();
  bytes->reserve(static_cast<std::size_t>(values) * p.height);
  for (std::uint32_t y = 0; y < p.height; ++y)
    for (std::uint64_t i = 0; i < values; ++i) bytes->push_back(static_cast<std::byte>(value(y, i) >> shift));
  return to_gray({p.width, p.height, static_cast<std::uint32_t>(values), encoding, *bytes, false}, bytes);
}

void pick_bytes(const std::uint8_t* row, std::uint32_t width, const Encoding& e, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x, row += e.bytes) out[x] = row[e.r_g_b[0]];
}

/// BT.601 luma in 16-bit fixed point.
void weigh_colours(const std::uint8_t* row, std::uint32_t width, const Encoding& e, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x, row += e.bytes) {
    const std::uint32_t sum = 19595U * row[e.r_g_b[0]] + 38470U * row[e.r_g_b[1]] + 7471U * row[e.r_g_b[2]];
    out[x] = static_cast<std::uint8_t>((sum + 32768U) >> 16);
  }
}

/// [1 2 1]ᵀ[1 2 1]/16; the border mirrors, which keeps the mosaic's phase.
void smooth_mosaic(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below, std::uint32_t width,
                   std::uint8_t* out) {
  const auto column = [&](std::uint32_t x) { return above[x] + 2 * row[x] + below[x]; };
  for (std::uint32_t x = 0; x < width; ++x) {
    const std::uint32_t left = x > 0 ? x - 1 : std::min(1U, width - 1), right = x + 1 < width ? x + 1 : left;
    out[x] = static_cast<std::uint8_t>((column(left) + 2 * column(x) + column(right) + 8) >> 4);
  }
}

}  // namespace

bool is_known_encoding(std::string_view encoding) {
  return find_encoding(encoding) != nullptr || !of_one_byte(encoding).empty();
}

GrayImage to_gray(const RawPicture& p, std::shared_ptr<const void> owner) {
  if (const std::string encoding = of_one_byte(p.encoding); !encoding.empty())
    return to_gray_from_two_bytes(p, encoding);
  const Encoding* const e = find_encoding(p.encoding);
  constexpr std::uint32_t most_side = 65535;
  if (!e || p.width == 0 || p.height == 0 || p.width > most_side || p.height > most_side) return {};
  const std::uint64_t row_bytes = std::uint64_t{p.width} * e->bytes;
  if (p.stride < row_bytes || std::uint64_t{p.stride} * (p.height - 1) + row_bytes > p.pixels.size()) return {};

  const auto* const first = reinterpret_cast<const std::uint8_t*>(p.pixels.data());
  const auto row = [&](std::uint32_t y) { return first + static_cast<std::size_t>(y) * p.stride; };
  const int width = static_cast<int>(p.width), height = static_cast<int>(p.height);
  if (e->kind == Kind::gray) return {width, height, static_cast<std::ptrdiff_t>(p.stride), first, std::move(owner)};

  auto gray = std::make_shared<Pixels>(static_cast<std::size_t>(p.width) * p.height);
  for (std::uint32_t y = 0; y < p.height; ++y) {
    std::uint8_t* const out = gray->data() + static_cast<std::size_t>(y) * p.width;
    const std::uint32_t above = y > 0 ? y - 1 : std::min(1U, p.height - 1), below = y + 1 < p.height ? y + 1 : above;
    if (e->kind == Kind::rgb) weigh_colours(row(y), p.width, *e, out);
    if (e->kind == Kind::luma) pick_bytes(row(y), p.width, *e, out);
    if (e->kind == Kind::bayer) smooth_mosaic(row(above), row(y), row(below), p.width, out);
  }
  return {width, height, width, gray->data(), gray};
}

}  // namespace takt
