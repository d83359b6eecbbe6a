// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/clock/allan.h"
#include "takt/estimators/clock/clock_model.h"
#include "takt/estimators/clock/second_labels.h"
#include "takt/streams/clock_events.h"

/// A counter against a receiver's pulses. Sensor: the counter, its ticks as ns of the nominal rate; reference: UTC as
/// Unix time, or GPS time; without labels the pulses themselves, whole seconds unknown.
namespace takt {

struct PpsOptions {
  std::string method = "auto";          ///< kalman, hull, or auto: kalman with hull beside
  std::string reference = "utc";        ///< utc or gps
  bool falling_edge = false;            ///< the falling edge is the whole second
  std::string qerr = "auto";            ///< auto: where it lowers the scatter; on, off
  std::optional<double> pulse_error_s;  ///< no pulse is further off than this: makes hard bounds
  LabelOptions labels;
};

template <class Visitor>
void describe(PpsOptions& o, Visitor& v) {
  v("reference", o.reference, "scale of the result: utc or gps");
  v("falling_edge", o.falling_edge, "the falling edge of the pulse is the whole second");
  v("qerr", o.qerr, "take off the pulses' told errors (TIM-TP): auto, on, off");
  v("pulse_error_s", o.pulse_error_s, "no pulse is further off than this: the bounds rest on it");
  v("earliest_s", o.labels.earliest_s, "share of a second after its pulse from which on a label counts");
  v("latest_s", o.labels.latest_s, "share of a second after its pulse up to which a label counts");
  v("same_start", o.labels.same_start, "labels without arrival times: both logs began within the same second");
  v("old_dates", o.labels.old_dates, "dates before May 2007 are meant, not a week number that has rolled over");
}

/// What became of one pulse.
struct PulseStamp {
  std::size_t index = 0;  ///< in the stream
  std::int64_t device_ns = 0;
  DisciplinedStamp stamp;  ///< of the edge, half a tick behind the count; smoothed by all pulses
  bool used = false;       ///< false: an outlier
};

struct PpsResult {
  Estimate estimate;
  std::vector<PulseStamp> stamps;
};
/// `logs`: what receivers said, each in its own order of arrival.
[[nodiscard]] PpsResult discipline(const PulseStream& pulses, const std::vector<LabelStream>& logs,
                                   const PpsOptions& options = {});

/// σ of a clock's time after `since_s` without pulses, from its noise levels: [σ_x² + σ_y²t² + (½·σ_d·t²)² + q1·t +
/// q2·t³/3 + …]^½, and not less than its own Allan deviation says.
[[nodiscard]] double holdover_sigma_s(const ClockPrediction& last, const ClockNoise& noise, double since_s,
                                      const std::vector<AllanPoint>& allan);

}  // namespace takt
