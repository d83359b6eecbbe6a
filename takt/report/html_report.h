// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/report/table.h"

/// One self-contained HTML page: static SVG that mail and paper show, and interaction on top where scripts run.
namespace takt {

struct ReportOptions {
  std::vector<std::string> names;     ///< of several results, in their order; usually their files
  std::vector<ReportTable> tables{};  ///< shown before the plots of a single result
  bool interactive = true;            ///< with the script for readout, zoom and hiding series
};

[[nodiscard]] std::string html_report(const Estimate& result, const ReportOptions& options = {});
/// Several results side by side with their repeatability; then each one's evidence, folded.
/// Throws std::invalid_argument when there are none.
[[nodiscard]] std::string html_report(const std::vector<Estimate>& results, const ReportOptions& options = {});

/// A page of what is no offset.
struct ReportPage {
  std::string kind;  ///< the words above the heading: "cameras"
  std::string heading;
  Verdict verdict = Verdict::refused;
  std::vector<std::string> reasons;
  std::vector<ReportTable> tables;
  Evidence evidence;
  std::vector<std::string> notes;
  Provenance provenance;
};
[[nodiscard]] std::string html_report(const ReportPage& page);

}  // namespace takt
