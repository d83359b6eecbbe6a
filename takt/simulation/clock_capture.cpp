// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>

#include "takt/simulation/clock_rig.h"
#include "takt/streams/gateware_wire.h"

namespace takt {

namespace {

using Frames = std::vector<wire::Frame>;

void add_heartbeats(std::uint64_t from, std::uint64_t to, std::uint32_t clock_hz, int cameras, Frames& out) {
  const std::uint32_t features =
      64u | 1u << 8 | static_cast<unsigned>(cameras) << 12 | static_cast<unsigned>(cameras) << 16 | 1u << 20 | 8u << 28;
  const std::uint32_t words[] = {clock_hz, features, 0, wire::identity};
  std::uint16_t sequence = 1;  // the start itself was before the recording
  for (std::uint64_t t = from; t < to; t += std::uint64_t{1} << 24, ++sequence)
    out.push_back(
        {wire::Kind::heartbeat, static_cast<std::uint8_t>(sequence % 4), 0, sequence, t, words[sequence % 4]});
}

/// Bursts as `byte,arrival` rows tell them; the line idles between two.
void add_text(const ClockRecording& r, double tick_hz, Frames& out) {
  struct Burst {
    std::size_t first;
    std::int64_t ticks;
  };
  std::vector<Burst> bursts;
  const std::string& table = r.nmea_arrivals;
  for (std::size_t at = table.find('\n') + 1; at < table.size();) {
    Burst b{};
    const char* end = table.data() + table.size();
    const auto first = std::from_chars(table.data() + at, end, b.first);
    const auto ticks = std::from_chars(first.ptr + 1, end, b.ticks);
    bursts.push_back(b);
    at = static_cast<std::size_t>(ticks.ptr - table.data()) + 1;
  }
  std::uint16_t starts = 0, texts = 0;
  const double byte_ticks = tick_hz * 10 / 9600;
  for (std::size_t k = 0; k < bursts.size(); ++k) {
    const std::size_t to = k + 1 < bursts.size() ? bursts[k + 1].first : r.nmea.size();
    const auto start = static_cast<std::uint64_t>(bursts[k].ticks);
    out.push_back({wire::Kind::gnss_start, 0, 0, starts++, start, 0});
    for (std::size_t i = bursts[k].first; i < to; i += 4) {
      const std::size_t n = std::min<std::size_t>(4, to - i);
      std::uint32_t payload = 0;
      for (std::size_t b = 0; b < n; ++b)
        payload |= static_cast<std::uint32_t>(static_cast<unsigned char>(r.nmea[i + b])) << (8 * b);
      const auto done = start + static_cast<std::uint64_t>(byte_ticks * static_cast<double>(i + n - bursts[k].first));
      out.push_back({wire::Kind::gnss_text, 0, static_cast<std::uint8_t>(n - 1), texts++, done, payload});
    }
  }
}

}  // namespace

std::string as_gateware_capture(const ClockRecording& r, const ClockParameters& p) {
  const auto clock_hz = static_cast<std::uint32_t>(std::clamp(p.tick_hz, 0.0, 4e9));
  if (p.counter_bits < 64 || p.restart_at_s >= 0 || static_cast<double>(clock_hz) != p.tick_hz ||
      !(p.counter_start >= 4096 && p.counter_start < 9e18) || r.pulses.pulses.empty())
    return {};
  Frames frames;
  const auto first = static_cast<std::uint64_t>(p.counter_start);
  const auto last = static_cast<std::uint64_t>(r.pulses.pulses.back().ticks);
  add_heartbeats(first, last, clock_hz, static_cast<int>(r.cameras.size()), frames);
  for (const Pulse& pulse : r.pulses.pulses)
    frames.push_back({wire::Kind::pulse, 0, wire::flag_level, static_cast<std::uint16_t>(pulse.sequence.value_or(0)),
                      static_cast<std::uint64_t>(pulse.ticks), 0});
  add_text(r, p.tick_hz, frames);
  for (std::size_t c = 0; c < r.cameras.size(); ++c) {
    const auto channel = static_cast<std::uint8_t>(c);
    for (const Pulse& t : r.cameras[c].triggers.pulses)
      frames.push_back({wire::Kind::trigger, channel, wire::flag_level, static_cast<std::uint16_t>(*t.sequence),
                        static_cast<std::uint64_t>(t.ticks), 0});
    std::uint16_t sequence = 0;
    for (const FrameStrobe& f : r.cameras[c].strobes.strobes) {
      const std::uint32_t number = *f.sequence & 0xFFFF;
      frames.push_back({wire::Kind::exposure, channel, wire::flag_level, sequence++,
                        static_cast<std::uint64_t>(f.start_ticks), number});
      frames.push_back({wire::Kind::exposure, channel, 0, sequence++, static_cast<std::uint64_t>(f.end_ticks), number});
    }
  }
  std::stable_sort(frames.begin(), frames.end(),
                   [](const wire::Frame& a, const wire::Frame& b) { return a.stamp < b.stamp; });
  std::string bytes;
  for (const wire::Frame& f : frames)
    for (const std::uint8_t b : wire::encode(f)) bytes += static_cast<char>(b);
  return bytes;
}

}  // namespace takt
