// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

/// Parameters of a simulation as text: one description of each field drives the scenario files, the command line and
/// the record in truth.json. Beside a plain struct stands
///   template <class Visitor> void describe(Struct& p, Visitor& v) { v("exposure_s", p.exposure_s, "exposure time");
///   ... }
/// A field is a bool, a whole or floating number, a std::string, or an optional number; its name ends in its unit.
namespace takt {

struct Parameter {
  std::string field;
  std::string value;  ///< as text; empty for an empty optional
  std::string help;
  bool is_switch = false;
};

/// What a scenario file or a command line changes: field -> text.
using ParameterChanges = std::map<std::string, std::string>;

/// Conversions that take the whole text or throw std::invalid_argument.
void read_parameter(const std::string& text, bool& value);
void read_parameter(const std::string& text, int& value);
void read_parameter(const std::string& text, double& value);
void read_parameter(const std::string& text, std::string& value);
[[nodiscard]] std::string parameter_text(bool value);
[[nodiscard]] std::string parameter_text(int value);
[[nodiscard]] std::string parameter_text(double value);
[[nodiscard]] std::string parameter_text(const std::string& value);

template <class T>
void read_parameter(const std::string& text, std::optional<T>& value) {
  T read{};
  read_parameter(text, read);
  value = read;
}
template <class T>
[[nodiscard]] std::string parameter_text(const std::optional<T>& value) {
  return value ? parameter_text(*value) : "";
}

/// Every field with its present value.
template <class Struct>
[[nodiscard]] std::vector<Parameter> parameters(Struct p) {
  std::vector<Parameter> out;
  auto record = [&out](const std::string& field, const auto& value, const std::string& help) {
    out.push_back({field, parameter_text(value), help, std::is_same_v<std::decay_t<decltype(value)>, bool>});
  };
  describe(p, record);
  return out;
}

/// "no parameter 'expsure_s'; there are duration_s, ..."
[[noreturn]] void throw_unknown_parameter(const std::string& field, const std::vector<Parameter>& known);
[[noreturn]] void throw_bad_value(const std::string& field, const std::string& text, const std::string& why);

/// Throws std::invalid_argument naming the field and what was wrong with it.
template <class Struct>
void change(Struct& p, const ParameterChanges& changes) {
  for (const auto& [field, text] : changes) {
    bool found = false;
    auto assign = [&, &wanted = field, &value_text = text](const std::string& name, auto& value, const std::string&) {
      if (name != wanted) return;
      found = true;
      try {
        read_parameter(value_text, value);
      } catch (const std::invalid_argument& e) {
        throw_bad_value(name, value_text, e.what());
      }
    };
    describe(p, assign);
    if (!found) throw_unknown_parameter(field, parameters(p));
  }
}

/// One JSON object: numbers as numbers, switches as true and false, null where left to the simulator.
[[nodiscard]] std::string parameters_json(const std::vector<Parameter>& list);

}  // namespace takt
