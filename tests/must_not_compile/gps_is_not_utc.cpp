// SPDX-License-Identifier: Apache-2.0
#include "takt/time/time_scales.h"

int main() {
  const auto gps = takt::from_ns<takt::Gps>(0);
#ifdef WRONG
  const takt::Instant<takt::Utc> utc = gps;
#else
  const takt::Instant<takt::Utc> utc = takt::to_utc(gps);
#endif
  return static_cast<int>(takt::to_ns(utc));
}
