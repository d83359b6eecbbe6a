// SPDX-License-Identifier: Apache-2.0
// The report in a real browser: it renders, it reacts, and nothing complains.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "takt/report/html_report.h"
#include "takt/report/sample_for_tests.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

std::string found_browser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome", "chromium-headless-shell"})
    if (std::system((std::string("command -v ") + name + " >/dev/null 2>&1").c_str()) == 0) return name;
  return "";
}

/// Plays a user, and writes what it saw into attributes of <html>, where --dump-dom shows it.
const char* const user = R"js(<script>
window.addEventListener('error', e => document.documentElement.dataset.error = e.message);
window.addEventListener('load', () => {
  const seen = document.documentElement.dataset;
  const plots = [...document.querySelectorAll('svg.plot')];
  const sizes = plots.map(p => p.getBoundingClientRect());
  seen.plots = plots.length;
  seen.smallest = Math.round(Math.min(...sizes.map(s => Math.min(s.width, s.height))));
  seen.empty = [...document.querySelectorAll('svg.plot path.line, svg.plot path.segments, svg.plot path.columns')].filter(p => !(p.getTotalLength() > 0)).length;
  seen.overflow = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  const at = (p, share, type, extra) => {
    const s = p.getBoundingClientRect();
    p.dispatchEvent(new PointerEvent(type, {clientX: s.left + share * s.width, clientY: s.top + 50, bubbles: true, pointerId: 1, button: 0, ...extra}));
  };
  const canvas = document.querySelector('.canvas'), plot = canvas.querySelector('svg.plot');
  at(plot, .25, 'pointermove');
  seen.readout = [...canvas.querySelectorAll('.value')].map(v => v.textContent).join('|');
  at(plot, .25, 'pointerdown'); at(plot, .5, 'pointermove'); at(plot, .5, 'pointerup');
  seen.zoomed = plot.getAttribute('viewBox').split(' ').map(Number)[2] / 100000;
  seen.ticks = [...canvas.querySelectorAll('text.x')].map(t => t.textContent).join(' ');
  canvas.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape'}));
  seen.back = plot.getAttribute('viewBox');
  const key = canvas.querySelector('.key');
  key.click();
  seen.hidden = [...plot.querySelectorAll('path')].filter(p => p.style.display === 'none').length;
  key.click();
  canvas.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight'}));
  seen.probes = canvas.querySelectorAll('.probe').length;
});
</script>)js";

class ReportBrowser : public testing::Test {
 protected:
  void SetUp() override {
    browser_ = found_browser();
    if (browser_.empty()) GTEST_SKIP() << "no chromium here: the report's look and script are not tested";
    fs::create_directories(folder_);
  }
  ~ReportBrowser() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream in(folder_ / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  /// What the browser prints, when it opens the page with these flags.
  std::string open(const std::string& page, const std::string& flags) {
    std::ofstream(folder_ / "page.html") << page;
    const std::string command =
        "cd " + folder_.string() + " && timeout 90 " + browser_ +
        " --headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking"
        " --disable-component-update --disable-sync --hide-scrollbars --enable-logging=stderr --user-data-dir=" +
        (folder_ / ("profile" + std::to_string(++runs_))).string() + " " + flags + " file://" +
        (folder_ / "page.html").string() + " >dom 2>log";
    EXPECT_EQ(std::system(command.c_str()), 0) << read("log");
    return read("dom");
  }

  /// data-<name> of <html>.
  [[nodiscard]] static std::string seen(const std::string& dom, const std::string& name) {
    const std::string key = "data-" + name + "=\"";
    const auto at = dom.find(key);
    return at == dom.npos ? "missing" : dom.substr(at + key.size(), dom.find('"', at + key.size()) - at - key.size());
  }

  std::string browser_;
  fs::path folder_ = fs::path(testing::TempDir()) / ("takt_report_browser_" + std::to_string(getpid()));
  int runs_ = 0;
};

TEST_F(ReportBrowser, RendersAndReactsAtAnyWidth) {
  std::string page = html_report(report::sample());
  page.insert(page.find("</head>"), user);
  for (const char* width : {"1200,2000", "400,2000"}) {
    SCOPED_TRACE(width);
    const std::string dom = open(page, std::string("--dump-dom --window-size=") + width);
    EXPECT_EQ(read("log").find("CONSOLE"), std::string::npos) << read("log");
    EXPECT_EQ(seen(dom, "error"), "missing");
    EXPECT_EQ(seen(dom, "plots"), "9");
    EXPECT_GT(std::atoi(seen(dom, "smallest").c_str()), 150);
    EXPECT_EQ(seen(dom, "empty"), "0");
    EXPECT_EQ(seen(dom, "overflow"), "0") << "the page scrolls sideways";
    EXPECT_NE(seen(dom, "readout").find("mrad/s"), std::string::npos) << seen(dom, "readout");
    EXPECT_NEAR(std::atof(seen(dom, "zoomed").c_str()), 0.25, 0.01);
    EXPECT_EQ(seen(dom, "ticks").substr(0, 4), "21.0") << seen(dom, "ticks");
    EXPECT_EQ(seen(dom, "back"), "0 0 100000 100000");
    EXPECT_EQ(seen(dom, "hidden"), "1");
    EXPECT_EQ(seen(dom, "probes"), "2");
  }
}

TEST_F(ReportBrowser, ShowsTheSameWithoutScript) {
  const std::string page = html_report(report::sample(), {.names = {}, .interactive = false});
  static_cast<void>(open(page, "--window-size=1200,2400 --screenshot=shot.png"));
  ASSERT_TRUE(fs::exists(folder_ / "shot.png"));
  EXPECT_GT(fs::file_size(folder_ / "shot.png"), 50'000u) << "an empty page";
}

}  // namespace
}  // namespace takt
