// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/clock_columns.h"

#include <algorithm>
#include <charconv>
#include <cstdint>

#include "takt/recording/lower_case.h"

namespace takt {

bool contains_any(std::string_view text, std::initializer_list<std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [text](std::string_view w) { return text.find(w) != std::string_view::npos; });
}

ColumnName read_column_name(std::string_view header) {
  std::string text = lower_case(std::string(header));
  ColumnName out;
  const auto bracket = text.find_first_of("[(");
  if (bracket != std::string::npos) {
    const auto close = text.find_first_of("])", bracket);
    out.unit = text.substr(bracket + 1, close == std::string::npos ? close : close - bracket - 1);
    text.resize(bracket);
  }
  while (!text.empty() && (text.back() == ' ' || text.back() == '_')) text.pop_back();
  if (out.unit.empty())
    for (const char* unit : {"ns", "us", "ms", "s", "ticks"})
      if (text.ends_with(std::string("_") + unit)) {
        out.unit = unit;
        text.resize(text.size() - out.unit.size() - 1);
        break;
      }
  if (out.unit == "\xc2\xb5s") out.unit = "us";
  if (out.unit == "tick" || out.unit == "counts" || out.unit == "cycles") out.unit = "ticks";
  if (out.unit.empty() && contains_any(text, {"tick", "count", "cycle"})) out.unit = "ticks";
  out.name = text;
  return out;
}

std::optional<int> exponent_of(const std::string& unit) {
  if (unit == "ns") return 0;
  if (unit == "us") return 3;
  if (unit == "ms") return 6;
  if (unit == "s") return 9;
  return std::nullopt;
}

std::optional<std::int64_t> counter_value(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (text.starts_with("0x")) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), value, 16);
    if (text.size() == 2 || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return static_cast<std::int64_t>(value);
  }
  if (negative) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
  }
  if (text.starts_with('+')) text.remove_prefix(1);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return static_cast<std::int64_t>(value);
}

}  // namespace takt
