// SPDX-License-Identifier: Apache-2.0
#include "takt/report/html_report.h"

#include <stdexcept>

#include "takt/report/html.h"
#include "takt/report/sections.h"

namespace takt {

using namespace report;

namespace {

std::string page(const std::string& title, const std::string& body, bool interactive) {
  std::string out = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  out +=
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<link rel=\"icon\" href=\"data:,\">\n";
  out += "<title>" + escape(title) + "</title>\n<style>" + page_style + "</style>\n</head>\n<body>\n<main>\n" + body +
         "</main>\n";
  if (interactive) out += std::string("<script>") + page_script + "</script>\n";
  return out + "</body>\n</html>\n";
}

std::string single(const Estimate& e, const std::vector<ReportTable>& more) {
  return headline(e) + facts(e) + methods(e) + tables(more) + evidence(e.evidence, "") + assumptions(e) +
         provenance(e.provenance);
}

}  // namespace

std::string html_report(const ReportPage& p) {
  return page(p.heading,
              headline(p.kind, escape(p.heading), p.verdict, p.reasons) + tables(p.tables) + evidence(p.evidence, "") +
                  remarks(p.notes) + provenance(p.provenance),
              true);
}

std::string html_report(const Estimate& result, const ReportOptions& options) {
  return page(sentence(result), single(result, options.tables), options.interactive);
}

std::string html_report(const std::vector<Estimate>& results, const ReportOptions& options) {
  if (results.empty()) throw std::invalid_argument("html_report: no results");
  if (results.size() == 1) return html_report(results.front(), options);
  std::vector<std::string> names = options.names;
  while (names.size() < results.size()) names.push_back("result " + std::to_string(names.size() + 1));
  std::string body = comparison(results, names);
  for (std::size_t i = 0; i < results.size(); ++i) {
    const std::string prefix = "r" + std::to_string(i + 1) + "-";
    body += "<details>\n<summary>" + escape(names[i]) + "</summary>\n" + facts(results[i]) + methods(results[i]) +
            evidence(results[i].evidence, prefix) + assumptions(results[i]) + provenance(results[i].provenance) +
            "</details>\n";
  }
  return page(std::to_string(results.size()) + " results compared", body, options.interactive);
}

}  // namespace takt
