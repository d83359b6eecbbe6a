// SPDX-License-Identifier: Apache-2.0
// The scripts are run by the shells that they are for; a shell that is not there is skipped.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace takt::cli {
namespace {

std::string output_of(const std::string& shell, const std::string& script) {
  std::string quoted;
  for (const char c : script) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  std::FILE* pipe = popen((shell + " -c '" + quoted + "'").c_str(), "r");
  std::string out;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) out += static_cast<char>(c);
  pclose(pipe);
  return out;
}

/// What bash offers behind a line that ends in the last word.
std::string offered(const std::string& words) {
  return output_of("bash", "compopt() { :; }; source <(" TAKT_COMMAND " completion bash); COMP_WORDS=(" + words +
                               "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _takt; echo \"${COMPREPLY[*]}\"");
}

TEST(Completion, BashOffersVerbsOptionsAndChoices) {
  EXPECT_EQ(offered("takt insp"), "inspect\n");
  EXPECT_NE(offered("takt \"\"").find("pendulum"), std::string::npos);
  EXPECT_EQ(offered("takt align --sea"), "--search\n");
  EXPECT_EQ(offered("takt align --method co"), "correlation\n");
  EXPECT_EQ(offered("takt simulate hand"), "handheld\n");
  EXPECT_EQ(offered("takt simulate handheld --scen"), "--scenario\n");
  EXPECT_EQ(offered("takt completion z"), "zsh\n");
  EXPECT_EQ(offered("takt align /etc/host"), output_of("bash", "echo $(compgen -f /etc/host)"));
}

TEST(Completion, ScriptsAreWhatTheirShellsRead) {
  for (const char* shell : {"bash", "zsh", "fish"}) {
    if (std::system(("command -v " + std::string(shell) + " >/dev/null").c_str()) != 0) continue;
    const std::string check = std::string(TAKT_COMMAND) + " completion " + shell + " | " + shell + " -n";
    EXPECT_EQ(std::system(check.c_str()), 0) << shell;
  }
}

}  // namespace
}  // namespace takt::cli
