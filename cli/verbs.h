// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <string>

/// The command: one file a verb, which parses, calls a workflow and prints. docs: the contract in docs/cli.md.
namespace takt::cli {

/// Flags that every verb has.
struct Common {
  bool json = false;
  bool quiet = false;
  std::string output;  ///< -o: result object, JSON or YAML by extension
  std::string report;  ///< --report: HTML
  std::uint64_t seed = 1;
  int threads = 0;      ///< 0: all cores
  std::string command;  ///< the line as typed, for the provenance
};

/// What runs once the line is parsed; its value is the exit status.
using Action = std::function<int()>;

/// Each verb adds its subcommand; when it is the one that was typed, its callback sets `action`.
/// A new verb is a new file and one row in `all_verbs` (main.cpp).
using AddVerb = void (*)(CLI::App& app, Common& common, Action& action);
void add_calibrate(CLI::App& app, Common& common, Action& action);
void add_align(CLI::App& app, Common& common, Action& action);
void add_clock(CLI::App& app, Common& common, Action& action);
void add_listen(CLI::App& app, Common& common, Action& action);
void add_apply(CLI::App& app, Common& common, Action& action);
void add_inspect(CLI::App& app, Common& common, Action& action);
void add_dial(CLI::App& app, Common& common, Action& action);
void add_target(CLI::App& app, Common& common, Action& action);
void add_pendulum(CLI::App& app, Common& common, Action& action);
void add_track(CLI::App& app, Common& common, Action& action);
void add_simulate(CLI::App& app, Common& common, Action& action);
void add_experiment(CLI::App& app, Common& common, Action& action);
void add_convert(CLI::App& app, Common& common, Action& action);
void add_export(CLI::App& app, Common& common, Action& action);
void add_report(CLI::App& app, Common& common, Action& action);
void add_completion(CLI::App& app, Common& common, Action& action);

}  // namespace takt::cli
