// SPDX-License-Identifier: Apache-2.0
#include "takt/calibration/options.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

struct SampleOptions {
  std::optional<double> search_s;
  double line_delay_ms = 0.1;
  bool drift = false;
  int max_iterations = 20;
  std::string method = "auto";
};
template <class Visitor>
void describe(SampleOptions& o, Visitor& v) {
  v("search_s", o.search_s, "half-width of the search");
  v("line_delay_ms", o.line_delay_ms, "from row to row");
  v("drift", o.drift, "estimate the drift");
  v("max_iterations", o.max_iterations, "rounds");
  v("method", o.method, "which");
}

TEST(Options, TheNameHoldsTheUnit) {
  EXPECT_EQ(option_name("search_s").flag, "search");
  EXPECT_EQ(option_name("search_s").unit, "s");
  EXPECT_EQ(option_name("max_rate_rad_s").flag, "max-rate");
  EXPECT_EQ(option_name("max_rate_rad_s").unit, "rad/s");
  EXPECT_EQ(option_name("line_delay").flag, "line-delay");
  EXPECT_EQ(option_name("_s").flag, "-s");
}

TEST(Options, OneDescriptionGivesTheTable) {
  EXPECT_EQ(options_table(option_rows(SampleOptions{})),
            "| option | unit | default | meaning |\n|---|---|---|---|\n"
            "| `--search` | s | automatic | half-width of the search |\n"
            "| `--line-delay` | ms | 0.1 | from row to row |\n"
            "| `--drift` |  | off | estimate the drift |\n"
            "| `--max-iterations` |  | 20 | rounds |\n"
            "| `--method` |  | auto | which |\n");
}

TEST(Options, AndWhatWasUsed) {
  SampleOptions used;
  used.search_s = 1.5;
  EXPECT_EQ(option_rows(used)[0].value, "1.5");
  EXPECT_NE(options_json(option_rows(used)).find("\"search_s\": \"1.5\""), std::string::npos);
}

}  // namespace
}  // namespace takt
