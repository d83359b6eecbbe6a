// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/report/table.h"

/// The parts of the page, from top to bottom, as HTML. A part with nothing to say is empty.
namespace takt::report {

[[nodiscard]] std::string headline(const Estimate& e);     ///< the sentence, the verdict, its reasons
[[nodiscard]] std::string facts(const Estimate& e);        ///< the numbers, how to apply them, what they refer to
[[nodiscard]] std::string methods(const Estimate& e);      ///< every method's answer
[[nodiscard]] std::string assumptions(const Estimate& e);  ///< notes, and what the method adds
[[nodiscard]] std::string provenance(const Estimate& e);
/// The panels; `prefix` keeps ids apart where several results share a page.
[[nodiscard]] std::string evidence(const Estimate& e, const std::string& prefix);
[[nodiscard]] std::string tables(const std::vector<ReportTable>& tables);
/// Several results in one table with their repeatability.
[[nodiscard]] std::string comparison(const std::vector<Estimate>& results, const std::vector<std::string>& names);

}  // namespace takt::report
