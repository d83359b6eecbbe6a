// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/apply/exports.h"

/// `takt export`: a result in the file of another tool.
namespace takt {

struct ExportJob {
  Estimate result;
  std::string as;          ///< a name of export_names()
  std::string sensor;      ///< which of the result's sensors; empty: the first
  std::string intrinsics;  ///< camera file that adds what the result does not have; may be empty
};
struct ExportOutcome {
  Exported exported;
  std::vector<std::string> remarks;
};
/// Throws takt::Error; std::logic_error where the result has no answer.
[[nodiscard]] ExportOutcome export_result(const ExportJob& job);
[[nodiscard]] std::vector<std::string> export_names();

}  // namespace takt
