// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/calibration/evidence.h"
#include "takt/report/table.h"

/// The parts of the page, from top to bottom, as HTML. A part with nothing to say is empty.
namespace takt::report {

[[nodiscard]] std::string headline(const Estimate& e);  ///< the sentence, the verdict, its reasons
/// The same for what is no offset; `kind`: the words above the heading, `heading` as HTML.
[[nodiscard]] std::string headline(const std::string& kind, const std::string& heading, Verdict verdict,
                                   const std::vector<std::string>& reasons);
[[nodiscard]] std::string facts(const Estimate& e);        ///< the numbers, how to apply them, what they refer to
[[nodiscard]] std::string methods(const Estimate& e);      ///< every method's answer
[[nodiscard]] std::string assumptions(const Estimate& e);  ///< notes, and what the method adds
[[nodiscard]] std::string remarks(const std::vector<std::string>& notes);  ///< the notes alone
[[nodiscard]] std::string provenance(const Provenance& p);
/// The panels; `prefix` keeps ids apart where several results share a page.
[[nodiscard]] std::string evidence(const Evidence& e, const std::string& prefix);
[[nodiscard]] std::string tables(const std::vector<ReportTable>& tables);
/// Several results in one table with their repeatability.
[[nodiscard]] std::string comparison(const std::vector<Estimate>& results, const std::vector<std::string>& names);

}  // namespace takt::report
