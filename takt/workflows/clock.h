// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/clock/pair_clock.h"
#include "takt/estimators/clock/pps_clock.h"
#include "takt/recording/clock_csv.h"

/// `takt clock`: a counter against a receiver's pulses, or a device against a host.
namespace takt {

struct ClockJob {
  std::string input;  ///< a folder as `takt simulate clock` writes it, or one file of any kind below; may be empty
  std::string pps, pairs;
  std::vector<std::string> labels;  ///< NMEA or UBX
  std::string arrivals;             ///< byte,arrival of the labels' file; else <file>.arrivals.csv where there is one
  ClockCsvOptions csv;
  PpsOptions pulses;
  PairOptions exchanges;
};

struct ClockOutcome {
  Estimate estimate;
  std::vector<PulseStamp> stamps;  ///< one a pulse
  std::vector<std::string> files;
};
[[nodiscard]] ClockOutcome relate_clocks(const ClockJob& job);

/// One line a pulse: {"t_ns","reference_ns","sigma_s","lower_ns","upper_ns","state"}.
[[nodiscard]] std::string stamp_json(std::int64_t device_ns, const DisciplinedStamp& stamp);

}  // namespace takt
