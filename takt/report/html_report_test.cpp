// SPDX-License-Identifier: Apache-2.0
#include "takt/report/html_report.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "takt/report/sample_for_tests.h"

namespace takt::report {
namespace {

std::size_t count(const std::string& page, const std::string& what) {
  std::size_t n = 0;
  for (auto at = page.find(what); at != page.npos; at = page.find(what, at + 1)) ++n;
  return n;
}

/// Every element that is opened is closed, in order. By hand: std::regex overflows the stack on long pages.
void expect_balanced(const std::string& page) {
  std::vector<std::string> open;
  for (auto at = page.find('<'); at != page.npos; at = page.find('<', at)) {
    const auto end = page.find('>', at);
    ASSERT_NE(end, page.npos);
    const std::string tag = page.substr(at + 1, end - at - 1);
    const std::string name = tag.substr(0, tag.find_first_of(" \n"));
    at = end;
    if (name == "!DOCTYPE" || name == "meta" || name == "link" || tag.ends_with('/')) continue;
    if (name.starts_with('/')) {
      ASSERT_FALSE(open.empty()) << tag;
      ASSERT_EQ("/" + open.back(), name) << page.substr(at > 200 ? at - 200 : 0, 210);
      open.pop_back();
      continue;
    }
    open.push_back(name);
    if (name == "script" || name == "style") at = page.find("</" + name, at);
  }
  EXPECT_TRUE(open.empty());
}

TEST(HtmlReport, SaysTheSentenceAndStandsAlone) {
  const std::string page = html_report(sample());
  EXPECT_NE(page.find("<title>cam0 is 12.34 ± 0.08 ms early against imu0 (trusted)</title>"), page.npos);
  EXPECT_NE(page.find("<h1>cam0 is <b>12.34 ± 0.08 ms</b> early against imu0</h1>"), page.npos);
  EXPECT_EQ(count(page, "src="), 0u);
  EXPECT_EQ(count(page, "href="), count(page, "href=\"data:,\""));
  EXPECT_EQ(page.find("url("), page.npos);
  EXPECT_EQ(page.find("@import"), page.npos);
  expect_balanced(page);
  if (const char* keep = std::getenv("TAKT_KEEP_REPORT")) std::ofstream(keep) << page;
}

TEST(HtmlReport, DrawsEveryPanelAndEachUnitOnItsOwnAxis) {
  const std::string page = html_report(sample());
  EXPECT_EQ(count(page, "<figure "), 8u);
  EXPECT_EQ(count(page, "<svg class=\"chart\""), 9u);  // coherence and phase have different units
  for (const char* broken : {"=\"nan", "=\"-nan", ":nan", ",nan", "NaN", "inf,"})
    EXPECT_EQ(page.find(broken), page.npos) << broken;
}

TEST(HtmlReport, EscapesAllText) {
  const std::string evil = "<script>alert('x')</script>&\"'";
  Estimate e = sample();
  e.method = e.sensor = e.reference = evil;
  e.frame_row = "first";
  e.reasons = e.notes = {evil};
  e.extras = {{evil, 1, {}}};
  for (Estimate& other : e.estimates) {
    other.method = evil;
    other.reasons = {evil};
  }
  for (Panel& p : e.evidence.panels) {
    p.name = p.kind = p.title = p.caption = p.x.name = p.x.unit = evil;
    for (Series& s : p.y) s.name = s.unit = s.kind = evil;
    p.marks.push_back({evil, p.x.values.front()});
  }
  e.provenance = {evil, evil, {{evil, evil}}, 1, {{evil, evil}}};
  for (const std::string& page : {html_report(e), html_report({e, e}, {.names = {evil, evil}})}) {
    EXPECT_EQ(page.find("<script>alert"), page.npos);
    expect_balanced(page);
  }
}

TEST(HtmlReport, WeakShowsItsReasonAndRefusedHasNoNumber) {
  Estimate weak = sample();
  weak.doubt(Verdict::weak, "the halves (first, second) disagree by 0.4 ms");
  const std::string page = html_report(weak);
  EXPECT_NE(page.find("early against imu0</h1>"), page.npos);
  EXPECT_NE(page.find("<li>the halves (first, second) disagree by 0.4 ms</li>"), page.npos);
  Estimate refused = sample();
  refused.doubt(Verdict::refused, "the camera stood still");
  EXPECT_NE(html_report(refused).find("<h1>cam0 against imu0: refused: the camera stood still</h1>"), page.npos);
  EXPECT_EQ(html_report(refused).find("To correct a stamp"), page.npos);
  expect_balanced(html_report(refused));
}

TEST(HtmlReport, OddPanelsAreDrawnWithoutHarm) {
  Estimate e = sample();
  const double nan = std::nan(""), inf = HUGE_VAL;
  const std::vector<std::vector<double>> odd{{},
                                             {nan},
                                             {nan, nan},
                                             {1},
                                             {5, 5, 5},
                                             {0, inf, -inf, 1},
                                             {1e300, -1e300},
                                             {947848.6384083, 947848.6384084},
                                             {1e-300, 2e-300}};
  e.evidence.panels.clear();
  for (const char* kind : {"lines", "points", "stems", "histogram", "unheard of"})
    for (const auto& v : odd)
      e.evidence.panels.push_back({"p", kind, "t", "c", {"x", "s", v, {}}, {{"y", "s", v, v}, {"z", "", v, {}}}, {}});
  e.evidence.panels.push_back({"empty", "lines", "t", "c", {"x", "s", {}, {}}, {}, {{"mark", 0}}});
  const std::string page = html_report(e);
  expect_balanced(page);
  for (const char* broken : {"=\"nan", "=\"-nan", "=\"inf", "=\"-inf"})
    EXPECT_EQ(page.find(broken), page.npos) << broken;
}

TEST(HtmlReport, ManyPointsKeepTheFileSmall) {
  Estimate e = sample();
  Panel p{"big", "lines", "t", "c", {"time", "s", {}, {}}, {{"y", "rad/s", {}, {}}}, {}};
  for (int i = 0; i < 1'000'000; ++i) {
    p.x.values.push_back(i * 1e-3);
    p.y[0].values.push_back(i == 777'777 ? 9 : std::sin(i * 0.01));
  }
  e.evidence.panels = {p};
  EXPECT_LT(html_report(e).size(), 400'000u);
  EXPECT_NE(html_report(e).find("777.777"), std::string::npos) << "the one peak must survive";
}

TEST(HtmlReport, SeveralResultsAreComparedWithTheirRepeatability) {
  std::vector<Estimate> runs{method("ml", 0.0120, 1e-4), method("ml", 0.0122, 1e-4), method("ml", 0.0124, 1e-4)};
  runs.push_back(Estimate::refusal("ml", "still"));
  runs.back().sensor = "cam0";
  runs.back().reference = "imu0";
  const std::string page = html_report(runs, {.names = {"a.json", "b.json", "c.json", "d.json"}});
  EXPECT_NE(page.find("3 answers of 4 results: mean 12.20 ± 0.12 ms, standard deviation 200 µs, 2 times"), page.npos);
  expect_balanced(page);
  EXPECT_THROW(static_cast<void>(html_report(std::vector<Estimate>{})), std::invalid_argument);
}

}  // namespace
}  // namespace takt::report
