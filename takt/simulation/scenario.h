// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/simulation/parameters.h"

/// Scenarios: what differs from a simulation's defaults, in files of their own. Those of scenarios/ are part of takt.
namespace takt {

/// Whether `wanted` is a file, or one of takt's own by name ("212-clock-wrong-leap"), by number ("212") or by the name
/// without its number ("clock-wrong-leap", "wrong-leap").
[[nodiscard]] bool is_scenario(const std::string& wanted);

/// YAML with only the parameters that differ, `field: value` each. Throws takt::Error.
[[nodiscard]] ParameterChanges read_scenario(const std::string& wanted);

/// "001-still, 002-handheld, …"
[[nodiscard]] std::string scenario_names();

}  // namespace takt
