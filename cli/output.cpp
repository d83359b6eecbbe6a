// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/progress.h"
#include "takt/calibration/words.h"
#include "takt/error.h"
#include "takt/workflows/report.h"

namespace takt::cli {

namespace {

bool is_yaml(const std::string& path) {
  return path.ends_with(".yaml") || path.ends_with(".yml");
}

std::string painted(const std::string& s, const char* code, bool colour) {
  return colour ? fmt::format("\x1b[{}m{}\x1b[0m", code, s) : s;
}

const char* colour_of(Verdict v) {
  return v == Verdict::trusted ? "32" : v == Verdict::weak ? "33" : "31";
}

std::string table_of_methods(const Estimate& e, bool colour) {
  std::vector<std::vector<std::string>> cells;
  std::vector<std::string> paint;
  for (const Estimate& other : answers_at_one_epoch(e)) {
    const std::string offset = other.answered() ? time_words(*other.offset, other.sigma_s) : "no answer";
    const std::string why = other.reasons.empty() ? "" : other.reasons.front();
    const std::string name = other.reference.empty() || other.reference == e.reference
                                 ? other.method
                                 : other.method + ", " + other.reference;
    cells.push_back({name, offset, to_string(other.verdict), why});
    paint.push_back(colour_of(other.verdict));
  }
  // Columns are as wide as their widest cell, counted in characters: ± and µ have two bytes.
  const auto width = [](const std::string& s) {
    return static_cast<std::size_t>(std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  };
  std::vector<std::size_t> widths(3, 0);
  for (const auto& row : cells)
    for (std::size_t c = 0; c < widths.size(); ++c) widths[c] = std::max(widths[c], width(row[c]));
  std::string out;
  for (std::size_t r = 0; r < cells.size(); ++r) {
    std::string line = " ";
    for (std::size_t c = 0; c < cells[r].size(); ++c) {
      const std::string& cell = cells[r][c];
      line += " " + (c == 2 ? painted(cell, paint[r].c_str(), colour) : cell);
      if (c < widths.size()) line += std::string(widths[c] - width(cell) + 1, ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

}  // namespace

CLI::Validator writable_as(std::vector<std::string> endings) {
  return CLI::Validator(
      [endings](std::string& path) -> std::string {
        if (path.starts_with("/dev/")) return "";
        const auto folder = std::filesystem::path(path).parent_path();
        if (!folder.empty() && !std::filesystem::is_directory(folder))
          throw Error("cannot be written: there is no such folder", folder.string(),
                      "make it, or choose another place");
        if (std::any_of(endings.begin(), endings.end(), [&](const auto& e) { return path.ends_with(e); })) return "";
        return fmt::format("'{}' should end in {}", path, CLI::detail::join(endings, " or "));
      },
      "");
}

void add_common(CLI::App& verb, Common& common) {
  verb.add_flag("--json", common.json, "print one JSON object and nothing else");
  verb.add_flag("-q,--quiet", common.quiet, "print the one line that matters, without progress");
  verb.add_option("--seed", common.seed, "seed of everything random")->check(whole_number())->capture_default_str();
  verb.add_option("--threads", common.threads, "threads to use; 0: all cores")
      ->check(CLI::Range(0, 1024))
      ->type_name("INT")
      ->capture_default_str();
}

void add_result_output(CLI::App& verb, Common& common) {
  verb.add_option("-o,--output", common.output, "write the result: .json, .yaml")
      ->check(writable_as({".json", ".yaml", ".yml"}))
      ->type_name("FILE");
  verb.add_option("--report", common.report, "write the report")->check(writable_as({".html"}))->type_name("FILE.html");
}

int exit_status(const Estimate& e) {
  return e.verdict == Verdict::trusted ? 0 : 3;
}

std::string in_words(const Estimate& e, bool brief, bool colour) {
  std::string out = painted(sentence(e), "1", colour) + "\n";
  if (brief) return out;
  // The sentence has said the first reason where the verdict is not `trusted`.
  const std::size_t said = e.verdict == Verdict::trusted ? 0 : 1;
  for (std::size_t i = said; i < e.reasons.size(); ++i) out += "  - " + e.reasons[i] + "\n";
  if (e.estimates.size() > 1) out += "\n" + table_of_methods(e, colour);
  return out;
}

void write_outputs(const Estimate& e, const Common& common) {
  if (!common.output.empty()) write_result(e, common.output);
  if (!common.report.empty()) write_file(common.report, report_page({e}, {}));
}

int hand_over(const Estimate& e, const Common& common) {
  write_outputs(e, common);
  if (common.json)
    fmt::print("{}", to_json(e));
  else
    fmt::print("{}", in_words(e, common.quiet, colour_welcome(1)));
  return exit_status(e);
}

void write_result(const Estimate& e, const std::string& path) {
  write_file(path, is_yaml(path) ? to_yaml(e) : to_json(e));
}

Estimate read_result(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text;
  std::vector<char> buffer(1 << 16);
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0)
    text.append(buffer.data(), static_cast<std::size_t>(in.gcount()));
  if (!in.eof())
    throw Error(std::string("cannot be read: ") + std::strerror(errno), path, "name a result that takt wrote with -o");
  return is_yaml(path) ? estimate_from_yaml(text, path) : estimate_from_json(text, path);
}

}  // namespace takt::cli
