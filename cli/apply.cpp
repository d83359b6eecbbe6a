// SPDX-License-Identifier: Apache-2.0
// takt apply RESULT IN -o OUT: the recording with the stamps that the result says are right.
#include "takt/workflows/apply.h"

#include <fmt/core.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/interrupt.h"
#include "cli/open_options.h"
#include "cli/output.h"
#include "cli/output_place.h"
#include "takt/calibration/words.h"
#include "takt/error.h"

namespace takt::cli {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

struct Line {
  std::string result;
  ApplyJob job;
  bool rehearsal = false;
};

/// What can be found out before an hour of copying.
void check_places(const std::string& in, const std::string& out) {
  check_output_place(in, out, fs::is_directory(in));
  const auto container = [](const fs::path& p) {
    const std::string e = p.extension().string();
    return e == ".bag" || e == ".mcap" || e == ".db3";
  };
  const fs::path from(in), to(out);
  if (!fs::is_directory(in) && from.extension() != to.extension() && container(to))
    throw Error(fmt::format("apply does not convert {} to {}", from.extension().string(), to.extension().string()), out,
                "give it the ending of the input, or run takt convert on the copy");
}

Json to_json(const Line& line, const std::string& out, const Restamped& done) {
  Json streams = Json::array();
  for (const RestampedStream& s : done.streams)
    streams.push_back({{"name", s.name},
                       {"count", s.count},
                       {"earliest_before_ns", to_ns(s.earliest_before)},
                       {"earliest_after_ns", to_ns(s.earliest_after)},
                       {"latest_before_ns", to_ns(s.latest_before)},
                       {"latest_after_ns", to_ns(s.latest_after)}});
  return {{"schema", "takt/1"},
          {"result", line.result},
          {"verdict", to_string(line.job.result.verdict)},
          {"input", line.job.in},
          {"output", line.rehearsal ? Json() : Json(out)},
          {"dry_run", line.rehearsal},
          {"streams", std::move(streams)},
          {"notes", done.notes}};
}

/// "+3.177000000 ms"
std::string signed_words(Duration d) {
  return (d.count() < 0 ? "" : "+") + time_words(d, std::nullopt);
}

void print_in_words(const Line& line, const std::string& out, const Restamped& done, bool brief) {
  for (const RestampedStream& s : done.streams) {
    const Duration first = s.earliest_after - s.earliest_before, last = s.latest_after - s.latest_before;
    const std::string moved = first == last
                                  ? fmt::format("by {}", signed_words(first))
                                  : fmt::format("by {} at first, {} at last", signed_words(first), signed_words(last));
    fmt::print("{}: {} stamps {} {}\n", s.name, s.count, line.rehearsal ? "would move" : "moved", moved);
  }
  if (!line.rehearsal) fmt::print("written: {}\n", out);
  if (brief) return;
  for (const std::string& note : done.notes) fmt::print(stderr, "takt: {}\n", note);
}

int run_apply(Line line, const Common& common) {
  Estimate& result = line.job.result;
  result = read_result(line.result);
  if (!result.answered()) {
    fmt::print(stderr, "takt: {}: nothing to apply: {}\n", line.result, sentence(result));
    return exit_status(result);
  }
  const std::string& out = common.output;
  if (!line.rehearsal) check_places(line.job.in, out);
  Restamped done;
  if (line.rehearsal) {
    done = apply(line.job);
  } else {
    RemovedOnInterrupt temporary(temporary_name(out));
    line.job.out = temporary.path().string();
    done = apply(line.job);
    publish_recording(line.job.out, out);
    temporary.keep();
  }
  if (common.json)
    fmt::print("{}\n", to_json(line, out, done).dump(2, ' ', false, Json::error_handler_t::replace));
  else
    print_in_words(line, out, done, common.quiet);
  if (result.verdict == Verdict::weak)
    fmt::print(stderr, "takt: the result that was applied is {}\n", sentence(result));
  return exit_status(result);
}

}  // namespace

void add_apply(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("apply", "write a recording with the stamps that a result says are right");
  const auto line = std::make_shared<Line>();
  verb.add_option("RESULT", line->result, "what was found: JSON or YAML")->required();
  verb.add_option("IN", line->job.in, "the recording: a folder or file")->required();
  auto* output = verb.add_option("-o,--output", common.output, "the recording to write")->type_name("OUT");
  auto* rehearsal = verb.add_flag("--dry-run", line->rehearsal, "say what would change, write nothing");
  verb.add_option("--sensor", line->job.stream,
                  "stream whose stamps move, * and ? stand for any text (default: the result's sensor)");
  static const std::map<std::string, Moved> sides{{"sensor", Moved::sensor}, {"reference", Moved::reference}};
  verb.add_option("--move", line->job.moved, "which side's stamps move: the sensor's, or the reference's the other way")
      ->transform(CLI::CheckedTransformer(sides))
      ->type_name("sensor|reference")
      ->default_str("sensor");
  verb.add_flag("--record-time", line->job.record_time, "move the recorder's times along (bags)");
  static const std::map<std::string, ExposureInstant> instants{
      {"start", ExposureInstant::start}, {"middle", ExposureInstant::middle}, {"end", ExposureInstant::end}};
  verb.add_option("--instant", line->job.meaning.instant,
                  "let a frame's stamp mean this instant of its exposure (default: what it meant)")
      ->transform(CLI::CheckedTransformer(instants))
      ->type_name("start|middle|end");
  static const std::map<std::string, RowReference> rows{{"first", RowReference::first},
                                                        {"middle", RowReference::middle}};
  verb.add_option("--row", line->job.meaning.row, "and this row (default: the one it meant)")
      ->transform(CLI::CheckedTransformer(rows))
      ->type_name("first|middle");
  add_time_unit(verb, line->job.open);
  add_common(verb, common);
  verb.callback([line, output, rehearsal, &common, &action] {
    if (output->count() == 0 && rehearsal->count() == 0) throw CLI::RequiredError("--output");
    action = [line, &common] { return run_apply(*line, common); };
  });
}

}  // namespace takt::cli
