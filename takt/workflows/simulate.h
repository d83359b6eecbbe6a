// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/simulation/parameters.h"

/// takt simulate KIND: a folder with a recording and its truth.
namespace takt {

struct SimulationRequest {
  std::string folder;        ///< made anew; must not be there or be empty
  std::string scenario;      ///< a scenario file, or the name of one that the kind knows; empty: the kind's defaults
  ParameterChanges changes;  ///< on top of the scenario
  std::uint64_t seed = 1;
  int threads = 0;      ///< 0: as many as there are cores
  std::string command;  ///< for the provenance
  std::function<void(double)> progress;
};

/// One row a kind of recording.
struct SimulationKind {
  const char* name;
  const char* says;
  std::vector<Parameter> (*parameters)();
  /// Writes the folder and returns its truth, which stands in its truth.json too.
  /// Throws std::invalid_argument for parameters that no simulation can have, takt::Error for files.
  Estimate (*write)(const SimulationRequest& request);
};

[[nodiscard]] std::span<const SimulationKind> simulation_kinds();

/// "; nor is it a file or one of the scenarios …", for what went wrong with a name that is neither; else nothing.
[[nodiscard]] std::string scenario_advice(const std::string& scenario);

/// truth.json: the truth as a result object, and under "simulation" what it was made from.
[[nodiscard]] std::string truth_json(const Estimate& truth, const std::string& kind,
                                     const std::vector<Parameter>& parameters);

}  // namespace takt
