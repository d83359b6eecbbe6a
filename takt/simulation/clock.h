// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/time/clock_map.h"

namespace takt {

/// How the sensor's clock stands to the reference clock. True time zero is `reference_start` on the reference clock,
/// which runs true; simulators count seconds from there.
struct SimulatedClocks {
  double offset_s = 0;  ///< reference − sensor, in the middle of the recording
  double drift = 0;     ///< s/s
  Instant<ReferenceClock> reference_start = from_ns<ReferenceClock>(1'700'000'100'123'456'789);

  /// reference = sensor + offset + drift·(sensor − epoch), with the epoch in the middle of `duration_s`.
  [[nodiscard]] ClockMap<> sensor_to_reference(double duration_s) const {
    ClockPiece<SensorClock> piece;
    piece.offset = from_seconds(offset_s);
    piece.epoch =
        as<SensorClock>(from_ns<DeviceClock>(to_ns(reference_start + from_seconds(0.5 * duration_s) - piece.offset)));
    piece.drift = drift;
    return ClockMap<>(piece);
  }
  [[nodiscard]] Instant<ReferenceClock> at(double t_s) const { return reference_start + from_seconds(t_s); }
};

/// Stamps of either clock as the streams hold them.
template <class Clock>
[[nodiscard]] constexpr Stamp as_stamp(Instant<Clock> t) {
  return Stamp(t.time_since_epoch());
}

}  // namespace takt
