// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>

#include "takt/time/instant.h"

namespace takt {

/// Known relations are types: the cast between them is exact and includes leap seconds.
/// Utc counts Unix time (days of 86400 s since 1970-01-01; a leap second repeats the last second's count).
/// Tai counts from 1970-01-01 00:00:00 TAI; Gps from 1980-01-06 00:00:00 UTC.
struct Utc : ClockTag<Utc> {};
struct Tai : ClockTag<Tai> {};
struct Gps : ClockTag<Gps> {};

/// From `utc_s` (Unix seconds) on, TAI − UTC is `tai_minus_utc_s`.
struct LeapSecond {
  std::int64_t utc_s;
  int tai_minus_utc_s;
};

/// All leap seconds since 1972 (IERS Bulletin C up to 2026-07).
inline constexpr std::array<LeapSecond, 28> leap_seconds{{
    {63072000, 10},   {78796800, 11},   {94694400, 12},   {126230400, 13},  {157766400, 14}, {189302400, 15},
    {220924800, 16},  {252460800, 17},  {283996800, 18},  {315532800, 19},  {362793600, 20}, {394329600, 21},
    {425865600, 22},  {489024000, 23},  {567993600, 24},  {631152000, 25},  {662688000, 26}, {709948800, 27},
    {741484800, 28},  {773020800, 29},  {820454400, 30},  {867715200, 31},  {915148800, 32}, {1136073600, 33},
    {1230768000, 34}, {1341100800, 35}, {1435708800, 36}, {1483228800, 37},
}};

/// TAI − UTC in force at a UTC instant. Before 1972 (when UTC had no whole seconds) it is 10 s by convention.
constexpr int tai_minus_utc_s(Instant<Utc> t) {
  int value = leap_seconds.front().tai_minus_utc_s;
  for (const LeapSecond& leap : leap_seconds)
    if (to_ns(t) >= leap.utc_s * 1'000'000'000) value = leap.tai_minus_utc_s;
  return value;
}

/// 1980-01-06 00:00:00 UTC in Unix seconds, and TAI − GPS.
inline constexpr std::int64_t gps_epoch_utc_s = 315964800;
inline constexpr int tai_minus_gps_s = 19;

constexpr Instant<Tai> to_tai(Instant<Utc> t) {
  return from_ns<Tai>(to_ns(t) + std::int64_t{tai_minus_utc_s(t)} * 1'000'000'000);
}
constexpr Instant<Tai> to_tai(Instant<Gps> t) {
  return from_ns<Tai>(to_ns(t) + (gps_epoch_utc_s + tai_minus_gps_s) * 1'000'000'000);
}
constexpr Instant<Gps> to_gps(Instant<Tai> t) {
  return from_ns<Gps>(to_ns(t) - (gps_epoch_utc_s + tai_minus_gps_s) * 1'000'000'000);
}
constexpr Instant<Gps> to_gps(Instant<Utc> t) {
  return to_gps(to_tai(t));
}
/// During a leap second itself Unix time repeats the second before midnight.
constexpr Instant<Utc> to_utc(Instant<Tai> t) {
  for (auto leap = leap_seconds.rbegin(); leap != leap_seconds.rend(); ++leap) {
    const auto utc = from_ns<Utc>(to_ns(t) - std::int64_t{leap->tai_minus_utc_s} * 1'000'000'000);
    if (to_ns(utc) >= leap->utc_s * 1'000'000'000) return utc;
    const bool inside_leap = to_ns(utc) >= (leap->utc_s - 1) * 1'000'000'000;
    if (inside_leap && std::next(leap) != leap_seconds.rend()) return utc;
  }
  return from_ns<Utc>(to_ns(t) - std::int64_t{leap_seconds.front().tai_minus_utc_s} * 1'000'000'000);
}
constexpr Instant<Utc> to_utc(Instant<Gps> t) {
  return to_utc(to_tai(t));
}

/// "2021-06-10T00:00:00.000000000Z"
std::string to_string(Instant<Utc> t);

}  // namespace takt
