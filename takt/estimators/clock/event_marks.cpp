// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/event_marks.h"

#include <algorithm>

#include "takt/time/time_scales.h"

namespace takt {

namespace {

std::int64_t gps_ns(const EventMark& mark, std::int64_t ns) {
  return mark.scale == LabelScale::utc ? to_ns(to_gps(from_ns<Utc>(ns))) : ns;
}

}  // namespace

MarkedEvents marked_events(std::span<const EventMark> marks, int channel) {
  MarkedEvents out;
  out.strobes.name = "events";
  out.strobes.counter = {"gps", 1e9, 64};
  std::vector<FrameStrobe>& strobes = out.strobes.strobes;
  std::optional<std::uint16_t> count;
  bool open = false;  // the last strobe waits for its end
  const auto end_at = [&](std::int64_t t) {
    if (!open || t <= strobes.back().start_ticks) return;
    strobes.back().end_ticks = t;
    out.have_ends = true;
    open = false;
  };
  for (const EventMark& mark : marks) {
    if (mark.channel != channel) continue;
    if (!mark.valid) {
      ++out.unvouched;
      continue;
    }
    std::optional<std::int64_t> end;
    if (mark.falling_ns) end = gps_ns(mark, *mark.falling_ns);
    if (mark.rising_ns) {
      const std::int64_t start = gps_ns(mark, *mark.rising_ns);
      if (end && *end < start) end_at(*end), end.reset();
      if (strobes.empty() || start > std::max(strobes.back().start_ticks, strobes.back().end_ticks)) {
        if (count) out.lost += static_cast<std::uint16_t>(mark.count - *count - 1);
        count = mark.count;
        strobes.push_back({start, start, {}});
        open = true;
      }
    }
    if (end) end_at(*end);
    out.accuracy_s = std::max(out.accuracy_s, mark.accuracy_s);
  }
  // A pulse whose end was not told has no width to pair by.
  if (out.have_ends) std::erase_if(strobes, [](const FrameStrobe& s) { return s.end_ticks <= s.start_ticks; });
  return out;
}

}  // namespace takt
