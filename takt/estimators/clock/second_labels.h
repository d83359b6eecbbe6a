// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/estimators/clock/pulse_train.h"
#include "takt/streams/clock_events.h"

namespace takt {

struct LabelOptions {
  /// How long after its pulse a label may begin to arrive, as a share of a second. What comes nearer to a pulse than
  /// this may belong to either neighbour, and is not counted.
  double earliest_s = 0.03, latest_s = 0.93;
  /// Labels without arrival times: both logs began within the same second, so the first label names the first pulse.
  bool same_start = false;
  /// Dates before May 2007 are meant: else they are those of a receiver whose 10-bit week number has rolled over.
  bool old_dates = false;
};

/// A change of GPS − UTC within the recording.
struct LeapStep {
  std::int64_t gps_s = 0;  ///< from this GPS second on
  int gps_minus_utc_s = 0;
};

/// Which whole second each pulse of a segment is: GPS second = `gps_minus_count_s` + the pulse's number.
struct SegmentLabels {
  bool known = false;
  std::int64_t gps_minus_count_s = 0;
  std::size_t votes = 0, agreeing = 0, in_guard = 0, stale = 0, unvouched = 0;
  std::string why_not;  ///< where it is not known
};

struct LabelledTrain {
  std::vector<SegmentLabels> segments;
  std::vector<LeapStep> leaps;  ///< those that the labels themselves show, beside the table of takt/time
  std::vector<std::string> words;

  [[nodiscard]] int gps_minus_utc_s(std::int64_t gps_s) const;
  /// Unix time of a GPS instant.
  [[nodiscard]] std::int64_t utc_ns(std::int64_t gps_ns) const;
};

/// Pairs pulses and labels. A segment of which the labels do not speak with one voice stays ambiguous.
/// Each of `logs` is in its own order of arrival.
[[nodiscard]] LabelledTrain label_train(const PulseTrain& train, const PulseStream& pulses,
                                        const std::vector<LabelStream>& logs, const LabelOptions& options = {});

}  // namespace takt
