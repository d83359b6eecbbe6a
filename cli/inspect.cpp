// SPDX-License-Identifier: Apache-2.0
// takt inspect IN: what a recording holds and what is wrong with it.
#include "takt/workflows/inspect.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/open_options.h"
#include "cli/output.h"

namespace takt::cli {

namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

Json to_json(const StreamAudit& a) {
  const StampAudit& s = a.stamps;
  Json gaps = Json::array();
  for (const StampGap& gap : s.gaps) gaps.push_back({{"after_ns", to_ns(gap.after)}, {"length_s", gap.length_s}});
  std::vector<std::string> words = s.words;
  words.insert(words.end(), a.words.begin(), a.words.end());
  const bool any = s.count > 0;
  return {{"name", a.name},
          {"kind", a.kind},
          {"clock", a.clock},
          {"count", s.count},
          {"first_ns", any ? Json(to_ns(s.first)) : Json()},
          {"last_ns", any ? Json(to_ns(s.last)) : Json()},
          {"span_s", s.span_s},
          {"rate_hz", or_null(s.rate_hz)},
          {"gaps", std::move(gaps)},
          {"duplicates", s.duplicates},
          {"backward_steps", s.backward_steps},
          {"jitter_s", or_null(s.jitter_s)},
          {"resolution_ns", s.resolution ? Json(s.resolution->count()) : Json()},
          {"findings", std::move(words)}};
}

Json to_json(const Inspection& found) {
  Json streams = Json::array();
  for (const StreamAudit& a : found.streams) streams.push_back(to_json(a));
  return {{"schema", "takt/1"},
          {"path", found.path},
          {"format", found.format},
          {"streams", std::move(streams)},
          {"notes", found.notes}};
}

/// A duration in the unit that reads best: "256 ns", "1 us", "40 ms".
std::string short_time(double s) {
  if (s == 0) return "0";
  if (s < 1e-6) return fmt::format("{:.3g} ns", s * 1e9);
  if (s < 1e-3) return fmt::format("{:.3g} us", s * 1e6);
  if (s < 1) return fmt::format("{:.3g} ms", s * 1e3);
  return fmt::format("{:.3g} s", s);
}

void print_table(const std::vector<StreamAudit>& streams) {
  std::size_t width = 6, kinds = 8;
  for (const StreamAudit& a : streams) {
    width = std::max(width, a.name.size());
    kinds = std::max(kinds, a.kind.size());
  }
  constexpr const char* row = "{:<{}}  {:<{}} {:>8} {:>10} {:>9} {:>5} {:>6} {:>5} {:>9} {:>10}\n";
  fmt::print(row, "stream", width, "kind", kinds, "count", "span", "rate Hz", "gaps", "twice", "back", "jitter",
             "resolution");
  for (const StreamAudit& a : streams) {
    const StampAudit& s = a.stamps;
    fmt::print(row, a.name, width, a.kind, kinds, s.count, fmt::format("{:.3f} s", s.span_s),
               s.rate_hz ? fmt::format("{:.2f}", *s.rate_hz) : "-", s.gaps.size(), s.duplicates, s.backward_steps,
               s.jitter_s ? short_time(*s.jitter_s) : "-", s.resolution ? short_time(to_seconds(*s.resolution)) : "-");
  }
}

void print_in_words(const Inspection& found) {
  fmt::print("{}: {}\n\n", found.path, found.format);
  print_table(found.streams);
  for (const StreamAudit& a : found.streams) {
    if (a.words.empty() && a.stamps.words.empty()) continue;
    fmt::print("\n{}\n", a.name);
    for (const std::string& word : a.stamps.words) fmt::print("  {}\n", word);
    for (const std::string& word : a.words) fmt::print("  {}\n", word);
  }
  if (!found.notes.empty()) fmt::print("\nwhile reading\n");
  for (const std::string& note : found.notes) fmt::print("  {}\n", note);
}

struct Line {
  std::string path;
  OpenOptions open;
  bool index_alone = false;
};

}  // namespace

void add_inspect(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("inspect", "say what a recording holds: streams, rates, gaps, jitter, units");
  const auto line = std::make_shared<Line>();
  verb.add_option("IN", line->path, "recording: a folder or file of any known format")->required();
  verb.add_flag("--index", line->index_alone,
                "what the index of a bag, MCAP file or database tells, at once: all topics by the recorder's clock");
  add_open_options(verb, line->open);
  add_common(verb, common);
  verb.callback([line, &common, &action] {
    action = [line, &common] {
      const Inspection found = line->index_alone ? inspect_index(line->path) : inspect(line->path, line->open);
      if (common.json)
        fmt::print("{}\n", to_json(found).dump(2, ' ', false, Json::error_handler_t::replace));
      else
        print_in_words(found);
      return 0;
    };
  });
}

}  // namespace takt::cli
