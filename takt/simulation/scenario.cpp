// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/scenario.h"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include "takt/error.h"
#include "takt/shipped_scenarios.h"

namespace takt {

namespace {

const ShippedScenario* shipped(std::string_view wanted) {
  for (const ShippedScenario& s : shipped_scenarios) {
    const std::string_view name = s.name;
    const auto number_end = name.find('-');
    const std::string_view number = name.substr(0, number_end), bare = name.substr(number_end + 1);
    if (wanted == name || wanted == number || wanted == bare) return &s;
    if (bare.starts_with("clock-") && wanted == bare.substr(6)) return &s;
  }
  return nullptr;
}

std::string text_of(const std::string& wanted) {
  if (!std::filesystem::is_regular_file(wanted))
    if (const ShippedScenario* own = shipped(wanted)) return own->text;
  std::ifstream file(wanted);
  if (!file) throw Error("cannot be read", wanted, "give a scenario file, or a name: " + scenario_names());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

bool is_scenario(const std::string& wanted) {
  return std::filesystem::is_regular_file(wanted) || shipped(wanted) != nullptr;
}

ParameterChanges read_scenario(const std::string& wanted) {
  ParameterChanges out;
  const std::string text = text_of(wanted);
  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return out;
    if (!root.IsMap()) throw Error("is not a list of 'field: value'", wanted, "see the files in scenarios/");
    for (const auto& entry : root) {
      const std::string field = entry.first.as<std::string>();
      if (!entry.second.IsScalar())
        throw Error("'" + field + "' has no single value", fmt::format("{}:{}", wanted, entry.second.Mark().line + 1),
                    "write 'field: value'");
      out[field] = entry.second.Scalar();
    }
  } catch (const YAML::Exception& e) {
    throw Error(e.msg, fmt::format("{}:{}", wanted, e.mark.line + 1), "write 'field: value', one a line");
  }
  return out;
}

std::string scenario_names() {
  std::string all;
  for (const ShippedScenario& s : shipped_scenarios) all += (all.empty() ? "" : ", ") + std::string(s.name);
  return all;
}

}  // namespace takt
