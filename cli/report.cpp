// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/report.h"

#include <fmt/core.h>

#include <memory>

#include "cli/interrupt.h"
#include "cli/output.h"

namespace takt::cli {

/// takt report RESULT... -o FILE.html
void add_report(CLI::App& app, Common& common, Action& action) {
  CLI::App* verb = app.add_subcommand("report", "write results as an HTML page; several are compared");
  add_common(*verb, common);
  const auto files = std::make_shared<std::vector<std::string>>();
  verb->add_option("RESULT", *files, "results, JSON or YAML")->required();
  verb->add_option("-o,--output", common.output, "the page to write")
      ->required()
      ->check(writable_as({".html", ".htm"}))
      ->type_name("FILE.html");
  verb->callback([files, &common, &action] {
    action = [files, &common] {
      std::vector<Estimate> results;
      for (const std::string& file : *files) results.push_back(read_result(file));
      write_file(common.output, report_page(results, *files));
      if (common.json)
        fmt::print("{}", results.size() == 1 ? to_json(results.front()) : repeatability_json(results, *files));
      else
        fmt::print("{}", results.size() == 1 ? sentence(results.front()) + "\n" : repeatability_words(results, *files));
      return 0;
    };
  });
}

}  // namespace takt::cli
