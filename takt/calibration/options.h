// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <concepts>
#include <optional>
#include <string>
#include <vector>

/// Options are plain structs with physical defaults. One description of each field drives the command line, the record
/// of what was used and the docs. Beside the struct stands
///
///   template <class Visitor>
///   void describe(AlignmentOptions& o, Visitor& v) {
///     v("search_s", o.search_s, "half-width of the search; as far as the data allows when left out");
///     v("drift", o.drift, "estimate the clock drift too");
///   }
///
/// A field is a bool, a whole or floating number, a std::string, or an optional of these. Its name ends in its unit:
/// "search_s" becomes --search, in seconds.
namespace takt {

/// "line_delay_s" -> {"line-delay", "s"}.
struct OptionName {
  std::string flag;  ///< without dashes in front
  std::string unit;  ///< empty where the name has none
};
[[nodiscard]] OptionName option_name(const std::string& field);

/// One field with the value it has.
struct OptionRow {
  std::string field;
  std::string value;  ///< "automatic" for an empty optional
  std::string help;
};

[[nodiscard]] std::string option_value(bool v);
[[nodiscard]] std::string option_value(double v);
[[nodiscard]] std::string option_value(const std::string& v);
template <std::integral Whole>
[[nodiscard]] std::string option_value(Whole v) {
  return std::to_string(v);
}
template <class T>
[[nodiscard]] std::string option_value(const std::optional<T>& v) {
  return v ? option_value(*v) : "automatic";
}

/// The visitor that writes an options struct down.
template <class Options>
[[nodiscard]] std::vector<OptionRow> option_rows(Options options) {
  std::vector<OptionRow> rows;
  const auto record = [&rows](const std::string& field, const auto& value, const std::string& help) {
    rows.push_back({field, option_value(value), help});
  };
  describe(options, record);
  return rows;
}

/// As a Markdown table for the docs: option, unit, default, meaning.
[[nodiscard]] std::string options_table(const std::vector<OptionRow>& rows);
/// As one JSON object of field -> value, all values as text.
[[nodiscard]] std::string options_json(const std::vector<OptionRow>& rows);

}  // namespace takt
