// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
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

/// Runs of one IMU at one temperature, give or take half a degree.
struct RepeatBin {
  std::string sensor, reference;
  std::optional<double> temperature_c;  ///< mean of its runs; nothing where it is not known
  std::size_t runs = 0, answers = 0;
  double mean_s = 0;
  std::optional<double> std_s;  ///< from run to run (n − 1); from two answers on
  double sigma_s = 0;           ///< root mean square of the stated σ
};

/// By IMU, then from cold to warm; runs without a temperature last.
[[nodiscard]] std::vector<RepeatBin> repeat_bins(const std::vector<PendulumRun>& runs);

/// A table for people.
[[nodiscard]] std::string repeat_words(const std::vector<RepeatBin>& bins);

/// One result for all runs: the first IMU's mean, the other IMUs' and each run's among `estimates`, plots of the delays
/// run by run and against the temperature.
[[nodiscard]] Estimate repeat_estimate(const std::vector<PendulumRun>& runs);
/// That result as JSON with "repeatability", one entry a bin.
[[nodiscard]] std::string repeat_json(const Estimate& whole, const std::vector<RepeatBin>& bins);

}  // namespace takt
