// SPDX-License-Identifier: Apache-2.0
#include "takt/apply/stamp_map.h"

#include <memory>

namespace takt {

namespace {

/// Of the exposure, from its start.
double share(ExposureInstant instant) {
  return instant == ExposureInstant::start ? 0 : instant == ExposureInstant::middle ? 0.5 : 1;
}

}  // namespace

std::function<Stamp(Stamp)> stamp_map(const Estimate& result, Moved moved) {
  const ClockMap<> map = result.clock_map();
  if (moved == Moved::sensor) return [map](Stamp t) { return from_ns(to_ns(map(as<SensorClock>(t)))); };
  return [back = inverse(map)](Stamp t) { return from_ns(to_ns(back(as<ReferenceClock>(t)))); };
}

Duration meaning_shift(const FrameTiming& timing, double exposure_s, double line_delay_s, const FrameMeaning& wanted) {
  double shift_s = 0;
  if (wanted.instant) shift_s += (share(*wanted.instant) - share(timing.instant)) * exposure_s;
  if (wanted.row && *wanted.row != timing.row) {
    const double half_readout_s = 0.5 * line_delay_s * timing.rows;
    shift_s += *wanted.row == RowReference::middle ? half_readout_s : -half_readout_s;
  }
  return from_seconds(shift_s);
}

std::string in_words(ExposureInstant instant, RowReference row) {
  const char* const when = instant == ExposureInstant::start    ? "the start"
                           : instant == ExposureInstant::middle ? "the middle"
                                                                : "the end";
  return std::string(when) + " of the exposure of the " + (row == RowReference::first ? "first" : "middle") + " row";
}

}  // namespace takt
