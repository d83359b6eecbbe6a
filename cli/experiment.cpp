// SPDX-License-Identifier: Apache-2.0
// takt experiment paper: the tables of [Fu2021] on the simulated rig, the paper's figures beside.
#include <fmt/core.h>

#include <memory>

#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/workflows/paper_experiment.h"
#include "takt/workflows/provenance.h"

namespace takt::cli {

void add_experiment(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("experiment", "run a known experiment again");
  verb.require_subcommand(1);
  CLI::App& paper = *verb.add_subcommand("paper", "tables 1 to 7 and figures 7 to 11 of the pendulum paper [Fu2021]");
  const auto options = std::make_shared<PaperExperimentOptions>();
  add_common(paper, common);
  paper.add_option("-o,--output", common.output, "Markdown file to write; else to stdout")->check(writable_as({".md"}));
  paper.add_option("--report", common.report, "write the report: the tables and the figures")
      ->check(writable_as({".html"}))
      ->type_name("FILE.html");
  paper.add_flag("--images", options->images, "read the angles from rendered pictures: some two minutes of two cores");
  paper.add_option("--runs", options->runs, "recordings a setting in tables 4 and 5, which are averaged")
      ->check(CLI::Range(2, 1000))
      ->default_val(options->runs);
  paper.add_option("--repeats", options->repeats, "recordings a temperature in tables 6 and 7")
      ->check(CLI::Range(2, 1000))
      ->default_val(options->repeats);
  paper.callback([options, &common, &action] {
    action = [options, &common] {
      ProgressBar bar(common, "runs");
      options->seed = common.seed;
      options->threads = common.threads;
      options->progress = [&bar](double fraction) { bar(fraction); };
      PaperExperiment out = paper_experiment(*options);
      out.estimate.provenance = make_provenance(common.command, {}, common.seed);
      if (!common.output.empty()) write_file(common.output, out.markdown);
      if (!common.report.empty()) write_file(common.report, out.html);
      if (common.json)
        fmt::print("{}", to_json(out.estimate));
      else if (common.output.empty())
        fmt::print("{}", out.markdown);
      return 0;
    };
  });
}

}  // namespace takt::cli
