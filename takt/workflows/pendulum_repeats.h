// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"

/// Several recordings of one rig: how far they agree, and what the temperature does ([Fu2021] tables 6 and 7, fig. 11).
namespace takt {

/// What one recording gave, one estimate an IMU.
struct PendulumRun {
  std::string name;
  std::vector<Estimate> estimates;
};

/// One result for all runs: the first IMU's mean, the other IMUs' and each run's among `estimates`, plots of the delays
/// run by run and against the temperature. Throws std::invalid_argument when there are no runs.
[[nodiscard]] Estimate repeat_estimate(const std::vector<PendulumRun>& runs);
/// That result as JSON with "repeatability": an entry an IMU, and in it one a temperature.
[[nodiscard]] std::string repeat_json(const Estimate& whole, const std::vector<PendulumRun>& runs);
/// The same for people.
[[nodiscard]] std::string repeat_words(const std::vector<PendulumRun>& runs);

}  // namespace takt
