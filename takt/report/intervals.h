// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"

namespace takt::report {

/// Small pictures for a table's column: each answer as a dot with ±1 σ, all on one scale.
class Intervals {
 public:
  explicit Intervals(const std::vector<Estimate>& answers);
  /// Empty for a refused result and where there is nothing to compare.
  [[nodiscard]] std::string svg(const Estimate& e) const;

 private:
  Duration base_{0};  ///< offsets are drawn relative to it, so that days keep their nanoseconds
  double low_s_ = 0, high_s_ = 0;
  std::size_t count_ = 0;
};

}  // namespace takt::report
