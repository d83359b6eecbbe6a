// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <exception>
#include <vector>

#include "cli/interrupt.h"
#include "cli/usage.h"
#include "cli/verbs.h"
#include "takt/commit.h"
#include "takt/error.h"
#include "takt/library_versions.h"
#include "takt/version.h"

namespace takt::cli {

/// One row a verb, in the order of the help.
// clang-format off
const std::vector<AddVerb> all_verbs{
    add_inspect,
    add_align,
    add_pendulum,
    add_dial,
    add_calibrate,
    add_target,
    add_track,
    add_clock,
    add_listen,
    add_apply,
    add_convert,
    add_export,
    add_simulate,
    add_experiment,
    add_report,
    add_completion,
};
// clang-format on

/// "takt 0.1.0 (commit 1e12a54)", and what it was built with: enough to make a result again.
std::string version_words() {
  std::string out = fmt::format("takt {}{}\n", version, *commit ? fmt::format(" (commit {})", commit) : "");
  for (const auto& [name, number] : library_versions) out += fmt::format("  {:14} {}\n", name, number);
  return out.substr(0, out.size() - 1);
}

int run(int argc, char** argv) {
  CLI::App app{"takt finds, tracks and removes the time offset between cameras, IMUs and GNSS receivers", "takt"};
  app.set_version_flag("--version", version_words());
  app.require_subcommand(0, 1);
  Common common;
  common.command = command_line(argc, argv);
  Action action;
  for (const AddVerb add : all_verbs) add(app, common, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
    fmt::print(stderr, "{}\n", usage_complaint(app, e));
    return 2;
  }
  if (!action) {
    fmt::print("{}", app.help());
    return 2;
  }
  return action();
}

}  // namespace takt::cli

int main(int argc, char** argv) {
  takt::cli::guard_against_interrupts();
  try {
    return takt::cli::run(argc, argv);
  } catch (const takt::Error& e) {
    fmt::print(stderr, "takt: {}\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "takt: internal error: {}\n", e.what());
  }
  return 1;
}
