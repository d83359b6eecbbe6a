// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/inspect.h"

#include "takt/recording/gateware.h"
#include "takt/recording/open_recording.h"

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

}  // namespace takt
