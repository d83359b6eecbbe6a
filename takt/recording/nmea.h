// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include "takt/streams/clock_events.h"

/// NMEA 0183 sentences that name an instant: RMC, ZDA, GGA.
namespace takt {

/// XOR of the bytes between `$` and `*` equals the two hexadecimal digits behind it. False where there are none.
[[nodiscard]] bool nmea_checksum_fits(std::string_view sentence);

/// Reads sentences one after the other: GGA has no date and takes that of the sentence before, ZDA has no status and
/// takes that of the last RMC.
class NmeaTime {
 public:
  /// What a sentence (`$` to checksum, already verified) says of time; nothing where it says none.
  [[nodiscard]] std::optional<TimeLabel> read(std::string_view sentence);

 private:
  std::optional<std::int64_t> last_utc_ns_;
  std::optional<bool> status_;
};

/// Days from 1970-01-01 to a date of the proleptic Gregorian calendar; nothing for a date that does not exist.
[[nodiscard]] std::optional<std::int64_t> days_from_date(int year, int month, int day);

}  // namespace takt
