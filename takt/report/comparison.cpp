// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include "takt/calibration/words.h"
#include "takt/report/html.h"
#include "takt/report/intervals.h"
#include "takt/report/repeatability.h"
#include "takt/report/sections.h"

namespace takt::report {

namespace {

std::string pair_words(const Repeatability& r) {
  return escape(r.sensor) + " against " + escape(r.reference);
}

std::string with_breaks(std::string html) {
  for (auto at = html.find('\n'); at != html.npos; at = html.find('\n', at + 6)) html.replace(at, 1, "<br/>\n");
  return html;
}

std::string rows(const std::vector<Estimate>& results, const std::vector<std::string>& names) {
  const Intervals intervals(results);
  std::string out;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const Estimate& e = results[i];
    const std::string drift =
        e.drift ? value_words(1e6 * *e.drift, e.drift_sigma ? std::optional(1e6 * *e.drift_sigma) : std::nullopt) : "";
    out += fmt::format(
        "<tr><td class=\"hash\">{}</td><td class=\"n\">{}</td><td class=\"span\">{}</td><td class=\"n\">{}</td>"
        "<td><span class=\"badge {}\">{}</span></td><td>{}</td></tr>\n",
        escape(names[i]), e.answered() ? time_words(*e.offset, e.sigma_s) : "no answer", intervals.svg(e), drift,
        to_string(e.verdict), to_string(e.verdict), escape(e.method));
  }
  return out;
}

}  // namespace

std::string comparison(const std::vector<Estimate>& results, const std::vector<std::string>& names) {
  const auto pairs = repeatability(results);
  std::string out =
      fmt::format("<header>\n<p class=\"kicker\">takt · comparison</p>\n<h1>{} results{}</h1>\n</header>\n",
                  results.size(), pairs.size() == 1 ? ": " + pair_words(pairs.front()) : "");
  for (const Repeatability& pair : pairs) {
    std::vector<Estimate> members;
    std::vector<std::string> member_names;
    for (const std::size_t i : pair.members) {
      members.push_back(results[i]);
      member_names.push_back(names[i]);
    }
    out += pairs.size() > 1 ? "<h2>" + pair_words(pair) + "</h2>\n" : "";
    out += "<p>" + with_breaks(escape(in_words(pair, names))) + "</p>\n" +
           "<div class=\"scroll\"><table>\n<tr><th>result</th><th>offset ± σ</th><th class=\"span\"></th>"
           "<th>drift, ppm</th><th>verdict</th><th>method</th></tr>\n" +
           rows(members, member_names) + "</table></div>\n";
  }
  return out + "<h2>Each result</h2>\n";
}

}  // namespace takt::report
