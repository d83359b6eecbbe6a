// SPDX-License-Identifier: Apache-2.0
#include "takt/time/instant.h"

int main() {
  const auto sensor = takt::from_ns<takt::SensorClock>(2);
#ifdef WRONG
  const auto other = takt::from_ns<takt::ReferenceClock>(1);
#else
  const auto other = takt::from_ns<takt::SensorClock>(1);
#endif
  return static_cast<int>((sensor - other).count());
}
