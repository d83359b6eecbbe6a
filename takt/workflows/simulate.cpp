// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/simulate.h"

#include <array>
#include <filesystem>

#include "takt/simulation/folder_writer.h"
#include "takt/simulation/handheld_parameters.h"

namespace takt {

namespace {

/// Defaults, then the scenario, then the request's own changes.
template <class Parameters>
Parameters parameters_for(const SimulationRequest& request) {
  Parameters p;
  if (std::filesystem::is_regular_file(request.scenario))
    change(p, read_scenario(request.scenario));
  else if (!request.scenario.empty())
    change(p, {{"motion", request.scenario}});
  change(p, request.changes);
  return p;
}

Estimate write_handheld(const SimulationRequest& request) {
  const auto p = parameters_for<HandheldParameters>(request);
  HandheldOptions options = to_options(p);
  options.seed = request.seed;
  options.threads = request.threads;
  SimulatedRecording made = simulate_handheld(options);
  made.truth.provenance.command = request.command;

  NewFolder folder(request.folder);
  if (options.footage == Footage::images)
    write_asl(made.recording, folder, request.threads, request.progress);
  else
    write_tracks(made.recording, folder);
  folder.write("truth.json", truth_json(made.truth, "handheld", parameters(p)));
  folder.finish();
  return made.truth;
}

const std::array<SimulationKind, 1> kinds{{
    {"handheld", "a camera and an IMU in a hand or on a vehicle, in a textured room",
     [] { return parameters(HandheldParameters{}); }, write_handheld},
}};

}  // namespace

std::span<const SimulationKind> simulation_kinds() {
  return kinds;
}

std::string truth_json(const Estimate& truth, const std::string& kind, const std::vector<Parameter>& list) {
  // Inserted as text, so that the result's own digits stay as they are.
  std::string out = to_json(truth);
  const auto last = out.find_last_of('}');
  const auto end = out.find_last_not_of(" \n", last - 1) + 1;
  return out.substr(0, end) + ",\n  \"simulation\": {\"kind\": \"" + kind +
         "\", \"parameters\": " + parameters_json(list) + "}\n}\n";
}

}  // namespace takt
