// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "takt/estimators/online/offset_tracker.h"

namespace takt {

/// What an online run has said so far, thinned so that hours fit.
class OffsetHistory {
 public:
  void observe(const OffsetNow& now, const OffsetTracker::Counts& counts);
  /// Adds the course of the offset to an answer: as evidence, and as pieces where one straight line does not hold all
  /// of it (steps, a drift that changes).
  /// `truth`, where it is known, is drawn beside.
  void complete(Estimate& e, const std::optional<Estimate>& truth) const;

 private:
  struct Said {
    Stamp stamp;
    Duration offset;
    double sigma_s, drift;
    std::size_t stretch;  ///< grows by one at each step of the offset
  };
  std::vector<Said> said_;
  double spacing_s_ = 0.02;
};

}  // namespace takt
