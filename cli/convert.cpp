// SPDX-License-Identifier: Apache-2.0
// takt convert IN -o OUT: a recording's IMUs and cameras in another format, which OUT's ending names.
#include "takt/workflows/convert.h"

#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/interrupt.h"
#include "cli/open_options.h"
#include "cli/output.h"
#include "cli/output_place.h"
#include "cli/progress.h"
#include "takt/workflows/apply.h"
#include "takt/workflows/half_written.h"

namespace takt::cli {

namespace {

using Json = nlohmann::ordered_json;

Json to_json(const ConvertJob& job, const std::string& out, const Written& done) {
  Json streams = Json::array();
  for (const WrittenStream& s : done.streams)
    streams.push_back({{"name", s.name}, {"written", s.written}, {"count", s.count}});
  return {
      {"schema", "takt/1"}, {"input", job.in}, {"output", out}, {"streams", std::move(streams)}, {"notes", done.notes}};
}

void print_in_words(const std::string& out, const Written& done, bool brief) {
  for (const WrittenStream& s : done.streams)
    fmt::print("{}: {} samples written{}\n", s.name, s.count, s.name == s.written ? "" : " as " + s.written);
  fmt::print("written: {}\n", out);
  if (brief) return;
  for (const std::string& note : done.notes) fmt::print(stderr, "takt: {}\n", note);
}

int run_convert(ConvertJob job, const Common& common) {
  const std::string& out = common.output;
  job.to = convert_to(out);
  job.threads = common.threads;
  check_output_place(job.in, out, job.to == ConvertTo::asl);
  const auto bar = std::make_shared<ProgressBar>(common, "pictures");
  job.progress = [bar](double fraction) { (*bar)(fraction); };
  RemovedOnInterrupt temporary(temporary_name(out));
  job.out = temporary.path().string();
  const RemovedOnInterrupt half(half_written(job.out));
  const Written done = convert(job);
  publish_recording(job.out, out);
  temporary.keep();
  if (common.json)
    fmt::print("{}\n", to_json(job, out, done).dump(2, ' ', false, Json::error_handler_t::replace));
  else
    print_in_words(out, done, common.quiet);
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("convert", "write a recording's IMUs and cameras in another format");
  const auto job = std::make_shared<ConvertJob>();
  verb.add_option("IN", job->in, "the recording: a folder or file")->required();
  verb.add_option("-o,--output", common.output,
                  "what to write: .mcap, .bag, .db3, .csv (one IMU), or without an ending an ASL folder")
      ->type_name("OUT")
      ->required();
  verb.add_option("--sensor", job->stream, "only streams of this name; * and ? stand for any text");
  add_open_options(verb, job->open);
  add_common(verb, common);
  verb.callback([job, &common, &action] { action = [job, &common] { return run_convert(*job, common); }; });
}

}  // namespace takt::cli
