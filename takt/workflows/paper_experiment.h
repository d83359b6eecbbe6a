// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <string>

namespace takt {

struct PaperExperimentOptions {
  std::uint64_t seed = 1;
  int repeats = 6;  ///< runs a temperature, tables 6 and 7
  int threads = 0;  ///< 0: as many as there are cores
  std::function<void(double)> progress;
};

/// Tables 1 to 7 and figures 10 and 11 of [Fu2021] on the simulated rig, at the level of angles, as Markdown: the
/// paper's figures beside `extrema`, `damped`, `spline` and the truth.
[[nodiscard]] std::string paper_experiment(const PaperExperimentOptions& options);

}  // namespace takt
