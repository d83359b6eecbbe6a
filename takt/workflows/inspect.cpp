// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/inspect.h"

#include <fmt/core.h>

#include <filesystem>
#include <optional>
#include <utility>

#include "takt/error.h"
#include "takt/recording/clock_csv.h"
#include "takt/recording/gateware.h"
#include "takt/recording/gnss_log.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/recorded_times.h"

namespace takt {

namespace {

StreamAudit audit(const PulseStream& pulses) {
  std::vector<Stamp> stamps;
  for (const Pulse& p : pulses.pulses)
    stamps.push_back(from_ns<DeviceClock>(middle_of_tick_ns(p.ticks, pulses.counter.tick_hz)));
  return {pulses.name, "pulses", pulses.counter.clock, audit(stamps), {}};
}

/// A capture's pulses are no sensor's stream, but what they look like is asked all the same.
void add_pulses(const std::string& path, std::vector<StreamAudit>& out) {
  for (const PulseStream& pulses : read_gateware_capture(path).pulses) out.push_back(audit(pulses));
}

/// What takt clock reads is no recording either: a table of pulses, or a receiver's log.
std::optional<Inspection> inspect_clock_file(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  if (looks_like_gnss(path)) {
    const LabelStream log = read_gnss_log(path);
    Inspection out{path, "receiver's log", {}, log.notes};
    for (const LabelStream::Count& c : log.counts)
      out.notes.push_back(fmt::format("{}: {} messages", c.message, c.count));
    out.notes.push_back("takt clock relates pulses to it");
    return out;
  }
  if (clock_table_in(path) != ClockTable::pulses) return std::nullopt;
  const PulseStream pulses = read_pulses_csv(path);
  return Inspection{path, "table of pulses", {audit(pulses)}, pulses.notes};
}

}  // namespace

Inspection inspect(const std::string& path, const OpenOptions& options) {
  std::optional<Recording> opened;
  try {
    opened = open_recording(path, options);
  } catch (const Error&) {
    if (auto found = inspect_clock_file(path)) return *std::move(found);
    throw;
  }
  const Recording& recording = *opened;
  Inspection out{recording.path, recording.format, audit(recording), recording.notes};
  if (recording.format == "gateware capture") add_pulses(path, out.streams);
  return out;
}

Inspection inspect_index(const std::string& path) {
  Inspection out{path, "index", {}, {}};
  for (const RecordedTimes& topic : recorded_times(path))
    out.streams.push_back({topic.channel.topic, topic.channel.type, "recorder", audit(topic.times), {}});
  out.notes.emplace_back(
      "times are the recorder's, from the index; the sensors' own stamps, units and pictures were not looked at");
  return out;
}

}  // namespace takt
