// SPDX-License-Identifier: Apache-2.0
// takt export RESULT --as NAME: the result in the file of another tool.
#include "takt/workflows/export.h"

#include <fmt/core.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "cli/interrupt.h"
#include "cli/output.h"

namespace takt::cli {

namespace {

using Json = nlohmann::ordered_json;

int run_export(ExportJob job, const std::string& result_file, const Common& common) {
  job.result = read_result(result_file);
  if (!job.result.answered()) {
    fmt::print(stderr, "takt: {}: nothing to export: {}\n", result_file, sentence(job.result));
    return exit_status(job.result);
  }
  const ExportOutcome done = export_result(job);
  if (!common.output.empty()) write_file(common.output, done.exported.text);
  if (common.json) {
    const Json object{{"schema", "takt/1"},
                      {"as", job.as},
                      {"verdict", to_string(job.result.verdict)},
                      {"output", common.output.empty() ? Json() : Json(common.output)},
                      {"text", done.exported.text},
                      {"sentence", done.exported.sentence},
                      {"remarks", done.remarks}};
    fmt::print("{}\n", object.dump(2, ' ', false, Json::error_handler_t::replace));
  } else if (common.output.empty()) {
    fmt::print("{}", done.exported.text);
    if (!common.quiet) fmt::print(stderr, "takt: {}\n", done.exported.sentence);
  } else {
    fmt::print("{}: {}\n", common.output, done.exported.sentence);
  }
  if (!common.quiet && !common.json)
    for (const std::string& remark : done.remarks) fmt::print(stderr, "takt: {}\n", remark);
  if (job.result.verdict == Verdict::weak)
    fmt::print(stderr, "takt: the result that was exported is {}\n", sentence(job.result));
  return exit_status(job.result);
}

}  // namespace

void add_export(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("export", "write a result in the file of another tool");
  const auto job = std::make_shared<ExportJob>();
  const auto result = std::make_shared<std::string>();
  verb.add_option("RESULT", *result, "what was found: JSON or YAML")->required();
  verb.add_option("--as", job->as, "the tool: " + CLI::detail::join(export_names(), ", "))
      ->required()
      ->check(CLI::IsMember(export_names()).description(""))
      ->type_name("TOOL");
  verb.add_option("--sensor", job->sensor, "which sensor, where the result has several (default: the first)");
  verb.add_option("--intrinsics", job->intrinsics,
                  "camera file for what the result has not: ASL sensor.yaml or camchain");
  verb.add_option("-o,--output", common.output, "file to write (default: the standard output)")->type_name("FILE");
  add_common(verb, common);
  verb.callback([job, result, &common, &action] {
    action = [job, result, &common] { return run_export(*job, *result, common); };
  });
}

}  // namespace takt::cli
