// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <cmath>
#include <cstdint>

namespace takt {

/// All stamps are int64 nanoseconds; a double holding Unix seconds would be 238 ns coarse.
using Duration = std::chrono::nanoseconds;

/// An instant on one clock. Instants of different clocks neither compare nor subtract: that does not compile.
template <class Clock>
using Instant = std::chrono::time_point<Clock, Duration>;

/// Clocks are names for types, never called: takt only reads stamps that others have made.
template <class Tag>
struct ClockTag {
  using duration = Duration;
  using rep = Duration::rep;
  using period = Duration::period;
  using time_point = Instant<Tag>;
  static constexpr bool is_steady = true;
};

/// The clock of whichever device gave the stamp; each stream names its own.
struct DeviceClock : ClockTag<DeviceClock> {};
/// The clock whose stamps are to be corrected, and the clock they are corrected to.
struct SensorClock : ClockTag<SensorClock> {};
struct ReferenceClock : ClockTag<ReferenceClock> {};

using Stamp = Instant<DeviceClock>;

template <class Clock = DeviceClock>
constexpr Instant<Clock> from_ns(std::int64_t ns) {
  return Instant<Clock>(Duration(ns));
}
template <class Clock>
constexpr std::int64_t to_ns(Instant<Clock> t) {
  return t.time_since_epoch().count();
}

/// Declares which role a device's stamp plays. The only way from one clock to another without a ClockMap.
template <class Role>
constexpr Instant<Role> as(Stamp t) {
  return Instant<Role>(t.time_since_epoch());
}

/// Seconds as a double, for estimators: only ever relative to an epoch nearby.
constexpr double to_seconds(Duration d) {
  return static_cast<double>(d.count()) * 1e-9;
}
template <class Clock>
constexpr double seconds_since(Instant<Clock> epoch, Instant<Clock> t) {
  return to_seconds(t - epoch);
}
/// Rounds to the nearest nanosecond, half away from zero.
inline Duration from_seconds(double s) {
  return Duration(static_cast<std::int64_t>(std::llround(s * 1e9)));
}

}  // namespace takt
