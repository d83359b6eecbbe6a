// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <memory>
#include <stdexcept>

#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/workflows/half_written.h"
#include "takt/workflows/simulate.h"

namespace takt::cli {

namespace {

/// "exposure_s" -> "--exposure,--exposure-s": the unit may be left out, for it is always the same.
std::string flags_of(const std::string& field) {
  std::string whole = field;
  for (char& c : whole)
    if (c == '_') c = '-';
  std::string flags = "--" + whole;
  for (const char* unit : {"-rad-s", "-m-s2", "-m-s", "-rad", "-ppm", "-deg", "-hz", "-px", "-s", "-m", "-c"})
    if (whole.ends_with(unit)) return "--" + whole.substr(0, whole.size() - std::string(unit).size()) + "," + flags;
  return flags;
}

/// Every parameter of the kind becomes an option that notes its text; the scenario comes first, then these.
void add_parameters(CLI::App& verb, const SimulationKind& kind, SimulationRequest& request) {
  for (const Parameter& p : kind.parameters()) {
    const std::string field = p.field;
    if (p.is_switch) {
      verb.add_flag_callback(
          flags_of(field), [&request, field] { request.changes[field] = "true"; }, p.help);
      continue;
    }
    verb.add_option_function<std::string>(
            flags_of(field), [&request, field](const std::string& text) { request.changes[field] = text; }, p.help)
        ->default_str(p.value);
  }
}

int simulate(const SimulationKind& kind, SimulationRequest request, const Common& common) {
  request.folder = common.output;
  request.seed = common.seed;
  request.threads = common.threads;
  request.command = common.command;
  const auto bar = std::make_shared<ProgressBar>(common, "pictures");
  request.progress = [bar](double fraction) { (*bar)(fraction); };
  try {
    const RemovedOnInterrupt unfinished(half_written(request.folder));
    const Estimate truth = kind.write(request);
    if (common.json)
      fmt::print("{}", to_json(truth));
    else if (!common.quiet)
      fmt::print("{}: {}\n", request.folder, sentence(truth));
  } catch (const std::invalid_argument& e) {
    fmt::print(stderr, "takt simulate {}: {}{}\n", kind.name, e.what(), scenario_advice(request.scenario));
    return 2;
  }
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, Common& common, Action& action) {
  CLI::App* verb = app.add_subcommand("simulate", "write a recording whose true offset is known");
  verb->require_subcommand(1);
  for (const SimulationKind& kind : simulation_kinds()) {
    const auto request = std::make_shared<SimulationRequest>();
    CLI::App* sub = verb->add_subcommand(kind.name, kind.says);
    sub->add_option("-o,--output", common.output, "folder to write; must not be there yet")->required();
    sub->add_option("--scenario", request->scenario,
                    "a scenario: a file, one of takt's own by name or number, or a motion");
    add_common(*sub, common);
    add_parameters(*sub, kind, *request);
    sub->callback([&kind, request, &common, &action] {
      action = [&kind, request, &common] { return simulate(kind, *request, common); };
    });
  }
}

}  // namespace takt::cli
