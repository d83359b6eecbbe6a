// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "takt/calibration/evidence.h"
#include "takt/workflows/paper_batch.h"

/// The recordings behind the tables of [Fu2021], made on the simulated rig and calibrated.
namespace takt {

struct PaperExperimentOptions {
  std::uint64_t seed = 1;
  int runs = 36;        ///< recordings a setting, tables 4 and 5: their means are a sixth as uncertain as one
  int repeats = 6;      ///< recordings a temperature, tables 6 and 7
  bool images = false;  ///< the angles are read from rendered pictures of the coded dial
  int threads = 0;      ///< 0: as many as there are cores
  std::function<void(double)> progress;
};

namespace paper {

inline constexpr std::array<double, 3> filters_ms{2.9, 3.9, 5.9};
inline constexpr std::array<double, 4> rates_hz{1000, 500, 250, 200};
inline constexpr std::array<double, 3> exposures_ms{1.0, 1.5, 2.0};
inline constexpr std::array<std::array<double, 2>, 3> windows_deg{{{15, 10}, {10, 5}, {5, 2}}};
inline constexpr std::array<std::array<double, 5>, 2> temperatures_c{
    {{24.5, 28.5, 37.0, 43.0, 45.0}, {27.5, 30.5, 40.0, 46.0, 48.5}}};

/// Delays in ms of one calibration, or the means of several: published, damped, spline, and the truth.
struct Delays {
  double extrema = NAN, damped = NAN, spline = NAN, sigma = NAN, truth = NAN;
  double swing_variance = NAN;  ///< ms², of the published estimator from swing to swing
};
/// Means; σ from the scatter.
[[nodiscard]] Delays mean_of(const std::vector<Delays>& runs);

struct Runs {
  Delays windows[3][4][3];              ///< filter, rate, window: tables 1 to 3
  std::vector<Panel> swings;            ///< figures 7 to 9: each swing's delay against its amplitude, a filter each
  std::vector<Delays> rates[3][4];      ///< filter, rate: table 4
  std::vector<Delays> exposures[3][3];  ///< exposure, meaning of the stamp: table 5; all taken for the middle
  std::vector<Delays> repeats[2][5];    ///< IMU, temperature: tables 6 and 7
  BatchDelay batch_rates[3][4];         ///< the same settings by the batch method on free motion, one recording each
  BatchDelay batch_exposures[3][3];
  BatchDelay batch_repeats[2][5];
};

[[nodiscard]] Runs run_experiments(const PaperExperimentOptions& options);

}  // namespace paper
}  // namespace takt
