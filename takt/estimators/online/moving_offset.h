// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <deque>
#include <utility>

#include "takt/estimators/online/frame_slip.h"
#include "takt/estimators/online/method.h"

/// What the methods share about an offset that may move.
namespace takt::online {

/// How clocks wander besides a constant drift: white phase steps (s/√s) and a drift that walks (1/√s).
constexpr double offset_walk = 3e-7, drift_walk = 2e-8;

/// What is believed of the offset when the two clocks may also be one, in which case nothing drifts: a mixture of both.
/// `drift_sigma`: of the drift before there were data.
void believe(const OffsetAndDrift& now, double drift_sigma, OffsetBelief& belief);

/// Notices that an offset has jumped: corrections of one that stays are independent, with the variances they take, so
/// their sum over any of the last stretches is judged.
class StepWatch {
 public:
  void clear() { *this = {}; }
  /// True where the offset must have stepped.
  [[nodiscard]] bool observe(double correction_s, double variance_before, double variance_after);
  /// What a new frame shows at once, before it has corrected anything (FrameSlip). `time_sigma_s`: what its stamp and
  /// the offset may be off anyway.
  void observe_slip(const FrameSlip& slip, double time_sigma_s);
  /// The strongest sign of a step, in sigmas.
  [[nodiscard]] double doubt() const { return std::max(of_corrections_, of_slips_); }

 private:
  double of_corrections_ = 0, of_slips_ = 0;
  std::deque<double> slips_;
  std::deque<std::pair<double, double>> corrections_;  ///< with the variance they took
};

}  // namespace takt::online
