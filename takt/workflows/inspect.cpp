// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/inspect.h"

#include "takt/recording/gateware.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/recorded_times.h"

namespace takt {

namespace {

/// A capture's pulses are no sensor's stream, but what they look like is asked all the same.
void add_pulses(const std::string& path, std::vector<StreamAudit>& out) {
  const GatewareCapture capture = read_gateware_capture(path);
  for (const PulseStream& pulses : capture.pulses) {
    std::vector<Stamp> stamps;
    for (const Pulse& p : pulses.pulses)
      stamps.push_back(from_ns<DeviceClock>(middle_of_tick_ns(p.ticks, capture.counter.tick_hz)));
    out.push_back({pulses.name, "pulses", capture.counter.clock, audit(stamps), {}});
  }
}

}  // namespace

Inspection inspect(const std::string& path, const OpenOptions& options) {
  const Recording recording = open_recording(path, options);
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
