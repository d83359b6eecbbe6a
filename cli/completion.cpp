// SPDX-License-Identifier: Apache-2.0
// takt completion bash|zsh|fish: a script that completes verbs, options and their choices.
#include "cli/completion.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "cli/verbs.h"

namespace takt::cli {

namespace {

/// One option as a shell sees it.
struct Flag {
  std::vector<std::string> names;  ///< with their dashes
  std::string help;
  bool takes_value = false;
  std::vector<std::string> choices;  ///< of the value; empty: a file, or anything
};

/// One verb, or a verb's kind ("simulate pendulum").
struct Verb {
  std::vector<std::string> words;  ///< {"simulate", "pendulum"}; empty: takt itself
  std::string help;
  std::vector<std::string> next;  ///< words that may follow
  std::vector<Flag> flags;
};

/// "TEXT:{auto,ml}" lists what CLI::IsMember allows.
std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto open = type.find('{'), close = type.rfind('}');
  if (open == type.npos || close == type.npos || close < open) return {};
  return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

std::vector<Flag> flags_of(const CLI::App& app) {
  std::vector<Flag> flags;
  for (const CLI::Option* option : app.get_options()) {
    Flag flag;
    for (const std::string& name : option->get_lnames()) flag.names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) flag.names.push_back("-" + name);
    if (flag.names.empty()) continue;  // a positional
    flag.help = option->get_description();
    flag.takes_value = option->get_items_expected_max() > 0;
    flag.choices = choices_of(*option);
    flags.push_back(std::move(flag));
  }
  return flags;
}

void walk(const CLI::App& app, const std::vector<std::string>& words, std::vector<Verb>& out) {
  Verb verb{words, app.get_description(), {}, flags_of(app)};
  const auto subs = app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* sub : subs) verb.next.push_back(sub->get_name());
  if (subs.empty())  // a positional with choices: "completion bash"
    for (const CLI::Option* option : app.get_options())
      if (option->get_positional())
        for (const std::string& choice : choices_of(*option)) verb.next.push_back(choice);
  out.push_back(std::move(verb));
  for (const CLI::App* sub : subs) {
    auto deeper = words;
    deeper.push_back(sub->get_name());
    walk(*sub, deeper, out);
  }
}

std::vector<Verb> verbs_of(const CLI::App& app) {
  std::vector<Verb> verbs;
  walk(app, {}, verbs);
  return verbs;
}

std::vector<std::string> names_of(const std::vector<Flag>& flags) {
  std::vector<std::string> names;
  for (const Flag& f : flags) names.insert(names.end(), f.names.begin(), f.names.end());
  return names;
}

std::string in_quotes(const std::string& s) {
  std::string out = "'";
  for (const char c : s) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// For zsh's _arguments, where brackets and colons have a meaning.
std::string escaped_for_zsh(const std::string& s) {
  std::string out;
  for (const char c : s)
    out += c == '[' || c == ']' || c == ':' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return out;
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string next, flags, values;
  for (const Verb& verb : verbs_of(app)) {
    const std::string key = fmt::format("{}", fmt::join(verb.words, " "));
    next += fmt::format("    '{}') echo {} ;;\n", key, in_quotes(fmt::format("{}", fmt::join(verb.next, " "))));
    flags +=
        fmt::format("    '{}') echo {} ;;\n", key, in_quotes(fmt::format("{}", fmt::join(names_of(verb.flags), " "))));
    for (const Flag& flag : verb.flags)
      if (!flag.choices.empty())
        for (const std::string& name : flag.names)
          values += fmt::format("    '{} {}') echo {} ;;\n", key, name,
                                in_quotes(fmt::format("{}", fmt::join(flag.choices, " "))));
  }
  return "# bash completion for takt; made by: takt completion bash\n"
         "_takt_next() {\n  case \"$1\" in\n" +
         next +
         "  esac\n}\n"
         "_takt_flags() {\n  case \"$1\" in\n" +
         flags +
         "  esac\n}\n"
         "_takt_values() {\n  case \"$1 $2\" in\n" +
         values +
         "  esac\n}\n"
         R"(_takt() {
  local current="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}" verb="" i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case " $(_takt_next "$verb") " in
      *" ${COMP_WORDS[i]} "*) verb="${verb:+$verb }${COMP_WORDS[i]}" ;;
      *) break ;;
    esac
  done
  local words
  words=$(_takt_values "$verb" "$before")
  if [[ -z $words && $current == -* ]]; then words=$(_takt_flags "$verb"); fi
  if [[ -z $words && $before != -* && $i -ge $COMP_CWORD ]]; then words=$(_takt_next "$verb"); fi
  if [[ -n $words ]]; then
    COMPREPLY=($(compgen -W "$words" -- "$current"))
  else
    COMPREPLY=($(compgen -f -- "$current"))
    compopt -o filenames 2>/dev/null
  fi
}
complete -F _takt takt
)";
}

std::string zsh_completion(const CLI::App& app) {
  std::string cases;
  for (const Verb& verb : verbs_of(app)) {
    std::string arguments;
    for (const Flag& flag : verb.flags)
      for (const std::string& name : flag.names) {
        std::string value;
        if (!flag.choices.empty())
          value = fmt::format(":value:({})", fmt::join(flag.choices, " "));
        else if (flag.takes_value)
          value = ":value:_files";
        arguments += " \\\n        " + in_quotes(fmt::format("{}[{}]{}", name, escaped_for_zsh(flag.help), value));
      }
    const std::string what =
        verb.next.empty() ? "*:file:_files" : fmt::format("1:word:({})", fmt::join(verb.next, " "));
    cases += fmt::format("    '{}') _arguments{} \\\n        {} ;;\n", fmt::join(verb.words, " "), arguments,
                         in_quotes(what));
  }
  std::string parents;
  for (const Verb& verb : verbs_of(app))
    if (!verb.words.empty()) parents += fmt::format(" '{}'", fmt::join(verb.words, " "));
  return "#compdef takt\n# made by: takt completion zsh\n_takt() {\n  local -a known=(" + parents + ")\n" +
         R"(  local verb="" candidate skip=0
  while (( skip + 1 < CURRENT )); do
    candidate="${verb:+$verb }${words[skip+2]}"
    (( ${known[(Ie)$candidate]} )) || break
    verb="$candidate"
    (( ++skip ))
  done
  (( CURRENT -= skip ))
  words=(takt "${(@)words[skip+2,-1]}")
  case "$verb" in
)" + cases +
         "  esac\n}\n_takt \"$@\"\n";
}

std::string fish_completion(const CLI::App& app) {
  std::string out = "# fish completion for takt; made by: takt completion fish\ncomplete -c takt -f\n";
  for (const Verb& verb : verbs_of(app)) {
    std::string when = verb.words.empty() ? "__fish_use_subcommand" : "";
    for (const std::string& word : verb.words)
      when += (when.empty() ? "" : "; and ") + std::string("__fish_seen_subcommand_from ") + word;
    if (!verb.next.empty() && !verb.words.empty())
      when += fmt::format("; and not __fish_seen_subcommand_from {}", fmt::join(verb.next, " "));
    for (const std::string& word : verb.next)
      out += fmt::format("complete -c takt -n {} -a {}\n", in_quotes(when), word);
    if (verb.next.empty()) out += fmt::format("complete -c takt -n {} -F\n", in_quotes(when));
    for (const Flag& flag : verb.flags) {
      std::string line = fmt::format("complete -c takt -n {}", in_quotes(when));
      for (const std::string& name : flag.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      if (flag.takes_value) line += flag.choices.empty() ? " -r -F" : " -x";
      if (!flag.choices.empty()) line += " -a " + in_quotes(fmt::format("{}", fmt::join(flag.choices, " ")));
      out += line + " -d " + in_quotes(flag.help) + "\n";
    }
  }
  return out;
}

void add_completion(CLI::App& app, Common&, Action& action) {
  CLI::App* verb =
      app.add_subcommand("completion", "print a script that completes takt's verbs and options in a shell");
  const auto shell = std::make_shared<std::string>();
  verb->add_option("SHELL", *shell, "which shell")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  verb->callback([&app, shell, &action] {
    action = [&app, shell] {
      fmt::print("{}", *shell == "bash"  ? bash_completion(app)
                       : *shell == "zsh" ? zsh_completion(app)
                                         : fish_completion(app));
      return 0;
    };
  });
}

}  // namespace takt::cli
