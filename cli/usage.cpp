// SPDX-License-Identifier: Apache-2.0
#include "cli/usage.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <numeric>

namespace takt::cli {

namespace {

/// Edits (insert, delete, replace, swap of neighbours) from one word to the other [Damerau1964].
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

const CLI::App& deepest(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? app : deepest(*chosen.back());
}

std::string full_name(const CLI::App& app) {
  return app.get_parent() ? full_name(*app.get_parent()) + " " + app.get_name() : app.get_name();
}

std::vector<std::string> verb_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(verb->get_name());
  return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::string about_unexpected(const CLI::App& verb, const std::string& typed) {
  const bool option = typed.starts_with("-");
  const bool verb_wanted = !option && !verb.get_parent();
  const std::string word = typed.substr(0, typed.find('='));
  const std::string meant = nearest(word, option        ? option_names(verb)
                                          : verb_wanted ? verb_names(verb)
                                                        : std::vector<std::string>{});
  const std::string kind = option ? "an option" : verb_wanted ? "a verb" : "expected here; it is one argument too many";
  return fmt::format("'{}' is not {}{}", word, kind, meant.empty() ? "" : "; did you mean " + meant + "?");
}

/// "say which: pendulum, handheld or ..." where a verb is several and none of them was named.
std::string about_missing_kind(const CLI::App& verb, const std::vector<std::string>& left) {
  const std::vector<std::string> kinds = verb_names(verb);
  const std::string which = "say which of " + CLI::detail::join(kinds, ", ");
  if (left.empty() || left.front().starts_with("-")) return which;
  const std::string meant = nearest(left.front(), kinds);
  return fmt::format("'{}' is none of its kinds; {}", left.front(),
                     meant.empty() ? which : "did you mean " + meant + "?");
}

std::string first_line(const std::string& s) {
  return s.substr(0, s.find('\n'));
}

}  // namespace

std::string nearest(const std::string& typed, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t fewest = std::max<std::size_t>(1, typed.size() / 3) + 1;
  for (const std::string& c : candidates)
    if (const std::size_t edits = edit_distance(typed, c); edits < fewest) {
      fewest = edits;
      best = c;
    }
  return best;
}

std::string usage_complaint(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& verb = deepest(app);
  const std::string hint = fmt::format(" ({} --help says more)", full_name(verb));
  const auto left = app.remaining(true);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) && !left.empty())
    return full_name(verb) + ": " + about_unexpected(verb, left.front()) + hint;
  if (verb.get_parent() && verb.get_require_subcommand_min() > 0)
    return full_name(verb) + ": " + about_missing_kind(verb, left) + hint;
  // A misspelt option may surface as a missing argument; the misspelling is what helps.
  for (const std::string& typed : left)
    if (typed.starts_with("-")) return full_name(verb) + ": " + about_unexpected(verb, typed) + hint;
  return full_name(verb) + ": " + first_line(error.what()) + hint;
}

std::string command_line(int argc, char** argv) {
  static const std::string safe = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=,:+@%";
  std::string line = argc > 0 ? std::filesystem::path(argv[0]).filename().string() : "takt";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (!word.empty() && word.find_first_not_of(safe) == word.npos) {
      line += " " + word;
      continue;
    }
    line += " '";
    for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += "'";
  }
  return line;
}

}  // namespace takt::cli
