// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"

namespace takt {

/// The HTML page of one result, or of several compared; `names` are the results' files.
[[nodiscard]] std::string report_page(const std::vector<Estimate>& results, const std::vector<std::string>& names);

/// How far several results of the same pair of sensors agree: a line a pair, or one JSON object with a row a result and
/// an entry a pair.
[[nodiscard]] std::string repeatability_words(const std::vector<Estimate>& results,
                                              const std::vector<std::string>& names = {});
[[nodiscard]] std::string repeatability_json(const std::vector<Estimate>& results,
                                             const std::vector<std::string>& names = {});

}  // namespace takt
