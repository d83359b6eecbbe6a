// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/parameters.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace takt {

namespace {

template <class Number>
void read_number(const std::string& text, Number& value, const char* kind) {
  Number read{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), read);
  if (error != std::errc{} || end != text.data() + text.size()) throw std::invalid_argument(kind);
  value = read;
}

}  // namespace

void read_parameter(const std::string& text, bool& value) {
  const bool yes = text == "true" || text == "on", no = text == "false" || text == "off";
  if (!yes && !no) throw std::invalid_argument("is not true or false");
  value = yes;
}
void read_parameter(const std::string& text, int& value) {
  read_number(text, value, "is not a whole number");
}
void read_parameter(const std::string& text, double& value) {
  double read = 0;
  read_number(text, read, "is not a number");
  if (!std::isfinite(read)) throw std::invalid_argument("is not finite");
  value = read;
}
void read_parameter(const std::string& text, std::string& value) {
  value = text;
}

std::string parameter_text(bool value) {
  return value ? "true" : "false";
}
std::string parameter_text(int value) {
  return std::to_string(value);
}
std::string parameter_text(double value) {
  return fmt::format("{}", value);
}
std::string parameter_text(const std::string& value) {
  return value;
}

void throw_unknown_parameter(const std::string& field, const std::vector<Parameter>& known) {
  std::string names;
  for (const Parameter& p : known) names += (names.empty() ? "" : ", ") + p.field;
  throw std::invalid_argument("no parameter '" + field + "'; there are " + names);
}

void throw_bad_value(const std::string& field, const std::string& text, const std::string& why) {
  throw std::invalid_argument(field + ": '" + text + "' " + why);
}

std::string parameters_json(const std::vector<Parameter>& list) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  for (const Parameter& p : list) {
    const auto value = nlohmann::ordered_json::parse(p.value, nullptr, false);
    if (p.value.empty())
      out[p.field] = nullptr;
    else if (value.is_number() || value.is_boolean())
      out[p.field] = value;
    else
      out[p.field] = p.value;
  }
  return out.dump(2);
}

}  // namespace takt
