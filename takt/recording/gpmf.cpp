// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gpmf.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <limits>

namespace takt::gpmf {

namespace {

constexpr int deepest_nest = 16;
constexpr std::size_t header_bytes = 8;

std::uint64_t big_endian(std::span<const std::byte> bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | std::to_integer<std::uint64_t>(bytes[at + i]);
  return value;
}

/// Size of one value of a type; 0 for a type that takt does not know (compressed '#', say).
std::size_t size_of(char type) {
  switch (type) {
    case 'b':
    case 'B':
    case 'c':
      return 1;
    case 's':
    case 'S':
      return 2;
    case 'l':
    case 'L':
    case 'f':
    case 'q':
    case 'F':
      return 4;
    case 'd':
    case 'j':
    case 'J':
    case 'Q':
      return 8;
    case 'G':
    case 'U':
      return 16;
    default:
      return 0;
  }
}

/// `bytes` starts at the value.
double value_of(char type, std::span<const std::byte> bytes) {
  const auto raw = [&bytes](std::size_t n) { return big_endian(bytes, 0, n); };
  switch (type) {
    case 'b':
      return static_cast<std::int8_t>(raw(1));
    case 'B':
    case 'c':
      return static_cast<double>(raw(1));
    case 's':
      return static_cast<std::int16_t>(raw(2));
    case 'S':
      return static_cast<double>(raw(2));
    case 'l':
      return static_cast<std::int32_t>(raw(4));
    case 'L':
    case 'F':
      return static_cast<double>(raw(4));
    case 'f':
      return std::bit_cast<float>(static_cast<std::uint32_t>(raw(4)));
    case 'q':  // Q15.16
      return static_cast<std::int32_t>(raw(4)) / 65536.0;
    case 'd':
      return std::bit_cast<double>(raw(8));
    case 'j':
      return static_cast<double>(static_cast<std::int64_t>(raw(8)));
    case 'J':
      return static_cast<double>(raw(8));
    case 'Q':  // Q31.32
      return static_cast<double>(static_cast<std::int64_t>(raw(8))) / 4294967296.0;
    default:
      return std::numeric_limits<double>::quiet_NaN();
  }
}

/// "Lf[3]B" -> "LfffB"; empty where it is malformed or longer than a sample can be (255 bytes).
std::string expanded(std::string_view structure) {
  std::string out;
  for (std::size_t i = 0; i < structure.size(); ++i) {
    if (structure[i] != '[') {
      out += structure[i];
      continue;
    }
    std::size_t count = 0;
    for (++i; i < structure.size() && structure[i] >= '0' && structure[i] <= '9' && count < 256; ++i)
      count = count * 10 + static_cast<std::size_t>(structure[i] - '0');
    if (out.empty() || count == 0 || count > 255 || i >= structure.size() || structure[i] != ']') return {};
    out.append(count - 1, out.back());
    if (out.size() > 255) return {};
  }
  return out.size() > 255 ? std::string() : out;
}

/// The type of each column of a sample; empty where they do not fill it exactly.
std::string columns_of(const Item& item, std::string_view structure) {
  std::string columns;
  if (item.type == '?') {
    columns = expanded(structure);
  } else if (const std::size_t one = size_of(item.type); one > 0 && item.sample_bytes % one == 0) {
    columns.assign(item.sample_bytes / one, item.type);
  }
  std::size_t bytes = 0;
  for (const char type : columns) {
    if (size_of(type) == 0) return {};
    bytes += size_of(type);
  }
  return bytes == item.sample_bytes ? columns : std::string();
}

bool is_key(std::span<const std::byte> bytes, std::size_t at) {
  for (std::size_t i = 0; i < 4; ++i) {
    const auto c = std::to_integer<unsigned char>(bytes[at + i]);
    if (c < 0x20 || c > 0x7e) return false;
  }
  return true;
}

std::string parse_level(std::span<const std::byte> bytes, std::size_t offset, int depth, std::vector<Item>& items) {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::size_t left = bytes.size() - at;
    // Some cameras fill up the end of a payload with zeros.
    if (left < 4 || big_endian(bytes, at, 4) == 0) return {};
    if (left < header_bytes) return fmt::format("an item is cut short at byte {}", offset + at);
    if (!is_key(bytes, at)) return fmt::format("no item begins at byte {}", offset + at);
    Item item;
    for (std::size_t i = 0; i < 4; ++i) item.key += static_cast<char>(bytes[at + i]);
    item.type = static_cast<char>(bytes[at + 4]);
    item.sample_bytes = big_endian(bytes, at + 5, 1);
    item.samples = big_endian(bytes, at + 6, 2);
    const std::size_t length = item.sample_bytes * item.samples;
    if (length > left - header_bytes)
      return fmt::format("{} at byte {} claims {} bytes, {} are left", item.key, offset + at, length,
                         left - header_bytes);
    item.bytes = bytes.subspan(at + header_bytes, length);
    std::string problem;
    if (item.type == 0) {
      if (depth + 1 >= deepest_nest) return fmt::format("{} at byte {} nests too deeply", item.key, offset + at);
      problem = parse_level(item.bytes, offset + at + header_bytes, depth + 1, item.children);
    }
    items.push_back(std::move(item));
    if (!problem.empty()) return problem;
    at += header_bytes + (length + 3) / 4 * 4;
  }
  return {};
}

std::optional<double> first_number(const Item& item) {
  const std::optional<Numbers> n = numbers(item);
  if (!n || n->values.empty() || !std::isfinite(n->values[0])) return std::nullopt;
  return n->values[0];
}

/// The first of several texts: a list of units has one a column.
std::string first_text(Item item) {
  if (item.sample_bytes > 1 && item.samples > 0) item.bytes = item.bytes.first(item.sample_bytes);
  return text(item);
}

/// Counters and clocks: whole numbers that a double holds exactly, and that still fit as nanoseconds (31 years of µs).
std::optional<std::int64_t> first_integer(const Item& item) {
  const std::optional<double> n = first_number(item);
  if (!n || std::abs(*n) > 1e15) return std::nullopt;
  return std::llround(*n);
}

/// Divides by one scale for all columns or one a column. False where they do not fit or are zero.
bool divide(Numbers& data, const std::vector<double>& scales) {
  if (scales.size() != 1 && scales.size() != data.columns) return false;
  for (const double s : scales)
    if (!std::isfinite(s) || s == 0) return false;
  for (std::size_t i = 0; i < data.values.size(); ++i)
    data.values[i] /= scales[scales.size() == 1 ? 0 : i % data.columns];
  return true;
}

std::optional<Stream> stream_of(const Item& strm, const std::string& device) {
  if (strm.children.empty()) return std::nullopt;
  Stream s;
  s.device = device;
  std::string structure;
  std::vector<double> scales{1};
  for (const Item& item : strm.children) {
    if (item.key == "STNM") s.name = text(item);
    if (item.key == "SIUN" || item.key == "UNIT") s.unit = first_text(item);
    if (item.key == "TSMP") s.total = first_integer(item);
    if (item.key == "STMP") s.stamp_us = first_integer(item);
    if (item.key == "TICK") s.tick_ms = first_integer(item);
    if (item.key == "TMPC") s.temperature_c = first_number(item);
    if (item.key == "TIMO") s.delay_s = first_number(item);
    if (item.key == "ORIN") s.stored_axes = text(item);
    if (item.key == "ORIO") s.output_axes = text(item);
    if (item.key == "TYPE") structure = text(item);
    if (item.key == "MTRX" || item.key == "SCAL")
      if (const auto n = numbers(item)) (item.key == "MTRX" ? s.matrix : scales) = n->values;
  }
  const Item& data = strm.children.back();
  std::optional<Numbers> values = numbers(data, structure);
  if (!values || !divide(*values, scales)) return std::nullopt;
  s.key = data.key;
  s.data = std::move(*values);
  return s;
}

}  // namespace

Payload parse(std::span<const std::byte> bytes) {
  Payload payload;
  payload.problem = parse_level(bytes, 0, 0, payload.items);
  return payload;
}

std::optional<Numbers> numbers(const Item& item, std::string_view structure) {
  const std::string columns = columns_of(item, structure);
  if (columns.empty()) return std::nullopt;
  Numbers out;
  out.rows = item.samples;
  out.columns = columns.size();
  out.values.reserve(out.rows * out.columns);
  std::size_t at = 0;
  for (std::size_t row = 0; row < out.rows; ++row)
    for (const char type : columns) {
      out.values.push_back(value_of(type, item.bytes.subspan(at, size_of(type))));
      at += size_of(type);
    }
  return out;
}

std::string text(const Item& item) {
  std::string out;
  for (const std::byte b : item.bytes) {
    const auto c = std::to_integer<unsigned char>(b);
    if (c == 0) continue;  // padding
    if (c < 0x80) {
      out += static_cast<char>(c);
    } else {  // Latin-1, as in "m/s²"
      out += static_cast<char>(0xC0 | c >> 6);
      out += static_cast<char>(0x80 | (c & 0x3F));
    }
  }
  return out;
}

std::vector<Stream> streams(const Payload& payload) {
  std::vector<Stream> out;
  for (const Item& device : payload.items) {
    if (device.key != "DEVC") continue;
    std::string name;
    for (const Item& item : device.children) {
      if (item.key == "DVNM") name = text(item);
      if (item.key != "STRM") continue;
      if (std::optional<Stream> s = stream_of(item, name)) out.push_back(std::move(*s));
    }
  }
  return out;
}

}  // namespace takt::gpmf
