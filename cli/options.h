// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <cmath>
#include <string>
#include <type_traits>

#include "takt/calibration/options.h"

namespace takt::cli {

/// Accepts numbers above zero. CLI11's own check names the largest double as the limit.
inline CLI::Validator above_zero() {
  return {[](std::string& typed) {
            double value = 0;
            const bool good = CLI::detail::lexical_cast(typed, value) && value > 0;
            return good ? std::string() : typed + " is not a number above 0";
          },
          "POSITIVE"};
}

/// Accepts any number that is one: CLI11 takes "nan" and "inf" as well.
inline CLI::Validator a_number() {
  return {[](std::string& typed) {
            double value = 0;
            const bool good = CLI::detail::lexical_cast(typed, value) && std::isfinite(value);
            return good ? std::string() : typed + " is not a number";
          },
          ""};
}

/// Accepts digits alone: CLI11 reads -1 as the largest number there is.
inline CLI::Validator whole_number() {
  return {[](std::string& typed) {
            const bool good = !typed.empty() && typed.find_first_not_of("0123456789") == std::string::npos;
            return good ? std::string() : typed + " is not a whole number";
          },
          ""};
}

/// Adds every field of an options struct (takt/calibration/options.h) to a verb: search_s -> --search, in seconds.
/// A switch that is on by default is turned off by --no-<name>. `options` must outlive the parse.
template <class Options>
void add_options(CLI::App& verb, Options& options) {
  const auto bind = [&verb](const std::string& field, auto& value, const std::string& help) {
    using Value = std::remove_reference_t<decltype(value)>;
    const OptionName name = option_name(field);
    const std::string flag = "--" + name.flag;
    if constexpr (std::is_same_v<Value, bool>) {
      verb.add_flag(flag + ",!--no-" + name.flag, value, help);
    } else {
      auto* option = verb.add_option(flag, value, name.unit.empty() ? help : help + " (" + name.unit + ")");
      option->default_str(option_value(value));
    }
  };
  describe(options, bind);
}

}  // namespace takt::cli
