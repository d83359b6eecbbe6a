// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace takt {

/// What the name of a column says, in lower case: "t_dev [ns]" -> name "t_dev", unit "ns".
struct ColumnName {
  std::string name;
  std::string unit;  ///< "ns", "us", "ms", "s", "ticks", or empty
};
[[nodiscard]] ColumnName read_column_name(std::string_view header);
/// 10^exponent of that unit against ns; nothing for ticks or no unit.
[[nodiscard]] std::optional<int> exponent_of(const std::string& unit);
[[nodiscard]] bool contains_any(std::string_view text, std::initializer_list<std::string_view> words);

/// A whole number of up to 64 bits, read as two's complement: counters that run past 2^63 go on from −2^63.
[[nodiscard]] std::optional<std::int64_t> counter_value(std::string_view text);

}  // namespace takt
