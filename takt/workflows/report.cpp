// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/report.h"

#include "takt/report/html_report.h"
#include "takt/report/repeatability.h"

namespace takt {

std::string report_page(const std::vector<Estimate>& results, const std::vector<std::string>& names) {
  return html_report(results, {.names = names});
}

std::string repeatability_words(const std::vector<Estimate>& results, const std::vector<std::string>& names) {
  std::string out;
  for (const Repeatability& r : repeatability(results))
    out += r.sensor + " against " + r.reference + ": " + in_words(r, names) + "\n";
  return out;
}

std::string repeatability_json(const std::vector<Estimate>& results) {
  return to_json(repeatability(results));
}

}  // namespace takt
