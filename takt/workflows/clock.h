// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/clock/pair_clock.h"
#include "takt/estimators/clock/pps_clock.h"
#include "takt/recording/clock_csv.h"

/// `takt clock`: a counter against a receiver's pulses, a device against a host, a camera's frames against their
/// strobes, or two sensors that share a trigger.
namespace takt {

struct ClockJob {
  std::string input;  ///< a folder as `takt simulate clock` writes it, or one file of any kind below; may be empty
  std::string pps, pairs;
  std::vector<std::string> labels;  ///< NMEA or UBX
  std::string arrivals;             ///< byte,arrival of the labels' file; else <file>.arrivals.csv where there is one
  std::string frames;               ///< a camera's frames, to be paired with strobes
  std::string strobes;              ///< a table of them; else those of the capture in `input`
  std::string camera;               ///< which of the capture's cameras; may be empty where there is one
  int event_channel = 0;            ///< input of the receiver whose events (TIM-TM2) are the frames' strobes
  std::vector<std::string> shared_trigger;  ///< device,arrival of two sensors that share a trigger
  ClockCsvOptions csv;
  PpsOptions pulses;
  PairOptions exchanges;
};

struct ClockOutcome {
  Estimate estimate;
  std::vector<PulseStamp> stamps;  ///< one a pulse, or one a frame
  std::vector<std::string> files;
};
[[nodiscard]] ClockOutcome relate_clocks(const ClockJob& job);

/// One line a pulse or frame: {"t_ns","reference_ns","sigma_s","lower_ns","upper_ns","state"}.
[[nodiscard]] std::string stamp_json(std::int64_t device_ns, const DisciplinedStamp& stamp);

}  // namespace takt
