// SPDX-License-Identifier: Apache-2.0
#include "cli/usage.h"

#include <gtest/gtest.h>

#include "cli/options.h"

namespace takt::cli {
namespace {

TEST(Nearest, FindsSlipsAndNothingElse) {
  const std::vector<std::string> verbs{"align", "apply", "inspect", "report"};
  EXPECT_EQ(nearest("algin", verbs), "align");
  EXPECT_EQ(nearest("repotr", verbs), "report");
  EXPECT_EQ(nearest("inspcet", verbs), "inspect");
  EXPECT_EQ(nearest("frobnicate", verbs), "");
  EXPECT_EQ(nearest("", verbs), "");
}

struct SampleOptions {
  std::optional<double> search_s;
  bool drift = false;
  bool robust = true;
};
template <class Visitor>
void describe(SampleOptions& o, Visitor& v) {
  v("search_s", o.search_s, "half-width of the search");
  v("drift", o.drift, "estimate the drift");
  v("robust", o.robust, "robust loss");
}

std::string complaint(std::vector<std::string> words) {
  CLI::App app{"", "takt"};
  CLI::App* verb = app.add_subcommand("align", "");
  SampleOptions options;
  add_options(*verb, options);
  std::string input;
  verb->add_option("IN", input)->required();
  std::reverse(words.begin(), words.end());
  try {
    app.parse(words);
  } catch (const CLI::ParseError& e) {
    return usage_complaint(app, e);
  }
  return "none";
}

TEST(UsageComplaint, IsOneLineWithWhatWasMeant) {
  EXPECT_EQ(complaint({"algin", "x"}), "takt: 'algin' is not a verb; did you mean align? (takt --help says more)");
  EXPECT_EQ(complaint({"align", "x", "--serach=3"}),
            "takt align: '--serach' is not an option; did you mean --search? (takt align --help says more)");
  EXPECT_EQ(complaint({"align", "x", "y"}),
            "takt align: 'y' is not expected here; it is one argument too many (takt align --help says more)");
  EXPECT_EQ(complaint({"align", "--serach"}),
            "takt align: '--serach' is not an option; did you mean --search? (takt align --help says more)");
  EXPECT_EQ(complaint({"align"}).find('\n'), std::string::npos);
  EXPECT_EQ(complaint({"align", "x", "--search", "1"}), "none");
}

TEST(AddOptions, BindsEveryFieldByItsName) {
  CLI::App app{"", "takt"};
  SampleOptions options;
  add_options(app, options);
  std::vector<std::string> words{"--no-robust", "--drift", "2.5", "--search"};
  app.parse(words);
  EXPECT_EQ(options.search_s, 2.5);
  EXPECT_TRUE(options.drift);
  EXPECT_FALSE(options.robust);
}

TEST(CommandLine, CanBeTypedAgain) {
  std::vector<std::string> words{"/usr/bin/takt", "align", "my drive", "it's", ""};
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  EXPECT_EQ(command_line(static_cast<int>(argv.size()), argv.data()), R"(takt align 'my drive' 'it'\''s' '')");
}

}  // namespace
}  // namespace takt::cli
