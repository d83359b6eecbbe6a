// SPDX-License-Identifier: Apache-2.0
// gyroflow: offsets {time of the video in µs: ms} with the opposite sign, at several times where the offset moves, and
// the readout. Its frame time is the middle row's.
#include <fmt/core.h>

#include "takt/apply/export_text.h"

namespace takt {

using namespace export_text;

Exported export_gyroflow(const CameraToImu& c) {
  std::string points;
  const auto add = [&](Stamp at, std::int64_t shift_ns) {
    points += fmt::format("{}    \"{}\": {}", points.empty() ? "" : ",\n", to_ns(at) / 1000, milliseconds(-shift_ns));
  };
  for (const OffsetPiece& p : c.pieces) add(p.epoch, p.offset.count());
  if (c.pieces.empty()) {
    add(c.epoch, c.shift_ns);
    constexpr std::int64_t minute_ns = 60'000'000'000;  // two points make the line
    if (c.drift != 0) add(c.epoch + Duration(minute_ns), c.shift_ns + from_seconds(c.drift * 60).count());
  }
  const std::string text = fmt::format(
      "{{\n  \"offsets\": {{\n{}\n  }},\n  \"stabilization\": {{\n    \"frame_readout_time\": {}\n  }}\n}}\n", points,
      number(1e3 * c.readout_s.value_or(0)));
  constexpr std::int64_t day_ns = 86'400'000'000'000;
  const bool absolute = to_ns(c.epoch) > day_ns;
  return {text,
          fmt::format("offsets of {} ms, gyroflow's sign being the opposite{}: {}", milliseconds(-c.shift_ns),
                      absolute ? "; its times begin with the video, so take the first frame's stamp off the keys" : "",
                      offset_words(c))};
}

}  // namespace takt
