// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/calibration/estimate.h"
#include "takt/workflows/paper_runs.h"

namespace takt {

/// Tables 1 to 7 and figures 7 to 11 of [Fu2021] on the simulated rig: the paper's figures beside `extrema`, `damped`,
/// `spline` and the truth. The column that the paper has from
/// Kalibr is the batch calibrator's, on free motion.
struct PaperExperiment {
  std::string markdown;
  std::string html;   ///< the report: the tables, and the figures as plots
  Estimate estimate;  ///< the first setting's delay; its evidence are the figures, its extras what the tables come to
};

[[nodiscard]] PaperExperiment paper_experiment(const PaperExperimentOptions& options);

}  // namespace takt
