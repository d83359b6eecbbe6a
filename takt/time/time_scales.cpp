// SPDX-License-Identifier: Apache-2.0
#include "takt/time/time_scales.h"

#include <cstdio>

namespace takt {

std::string to_string(Instant<Utc> t) {
  using namespace std::chrono;
  const sys_time<Duration> sys(t.time_since_epoch());
  const auto day = floor<days>(sys);
  const year_month_day date(day);
  const hh_mm_ss time(sys - day);
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d.%09lldZ", int(date.year()), unsigned(date.month()),
                unsigned(date.day()), int(time.hours().count()), int(time.minutes().count()),
                int(time.seconds().count()), static_cast<long long>(time.subseconds().count()));
  return text;
}

}  // namespace takt
