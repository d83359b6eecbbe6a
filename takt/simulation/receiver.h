// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>

namespace takt {

/// What a simulated receiver believes when it writes its messages of one second.
struct ReceiverSecond {
  std::int64_t gps_s = 0;    ///< of the pulse
  int gps_minus_utc_s = 18;  ///< as the receiver applies it
  bool leap_resolved = true;
  bool leap_second = false;       ///< this second is 23:59:60
  std::int64_t date_shift_s = 0;  ///< error of the date (week rollover)
  double fix_fraction_s = 0;
  double next_error_s = 0;  ///< qErr of the next pulse
};

/// RMC, ZDA and GGA.
[[nodiscard]] std::string nmea_messages(const ReceiverSecond& s);
/// NAV-PVT, NAV-TIMEGPS, NAV-TIMEUTC, and TIM-TP for the pulse to come.
[[nodiscard]] std::string ubx_messages(const ReceiverSecond& s);

}  // namespace takt
