// SPDX-License-Identifier: Apache-2.0
// takt experiment paper: the tables of [Fu2021] on the simulated rig, the paper's figures beside.
#include <fmt/core.h>

#include <memory>

#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/workflows/paper_experiment.h"

namespace takt::cli {

void add_experiment(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("experiment", "run a known experiment again");
  verb.require_subcommand(1);
  CLI::App& paper = *verb.add_subcommand("paper", "tables 1 to 7 and figures 10 and 11 of the pendulum paper [Fu2021]");
  const auto options = std::make_shared<PaperExperimentOptions>();
  add_common(paper, common);
  paper.add_option("-o,--output", common.output, "Markdown file to write; else to stdout")->check(writable_as({".md"}));
  paper.add_option("--repeats", options->repeats, "runs a temperature in tables 6 and 7")
      ->check(CLI::Range(2, 1000))
      ->default_val(options->repeats);
  paper.callback([options, &common, &action] {
    action = [options, &common] {
      ProgressBar bar(common, "runs");
      options->seed = common.seed;
      options->threads = common.threads;
      options->progress = [&bar](double fraction) { bar(fraction); };
      const std::string page = paper_experiment(*options);
      if (common.output.empty())
        fmt::print("{}", page);
      else
        write_file(common.output, page);
      return 0;
    };
  });
}

}  // namespace takt::cli
