// SPDX-License-Identifier: Apache-2.0
#include "takt/time/clock_map.h"

int main() {
  const takt::ClockMap<takt::SensorClock, takt::ReferenceClock> map;
#ifdef WRONG
  const auto stamp = takt::from_ns<takt::ReferenceClock>(1);
#else
  const auto stamp = takt::from_ns<takt::SensorClock>(1);
#endif
  return static_cast<int>(takt::to_ns(map(stamp)));
}
