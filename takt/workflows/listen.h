// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "takt/streams/clock_events.h"

/// `takt listen`: a device's bytes as they come, its events on UTC as they go.
namespace takt {

struct ListenStatus {
  std::string format;  ///< "gateware", "text", or empty while it is not known
  bool plugged = true;
  std::size_t pulses = 0, rejected = 0, labels = 0, events = 0, lost = 0, unplugged = 0;
  ClockState state = ClockState::ambiguous;
  std::string why;
  double rate_ppm = 0, sigma_s = 0;
};

struct ListenJob {
  std::string source;  ///< serial device, pipe, file, or "-"
  int baud = 115200;
  std::string format = "auto";                           ///< gateware, text, or auto
  std::optional<double> tick_hz;                         ///< of text; gateware says its own
  int counter_bits = 64;                                 ///< of text
  std::optional<double> pulse_error_s;                   ///< no pulse is further off than this: makes hard bounds
  std::string mcap;                                      ///< file of all events; may be empty
  std::function<void(const std::string& json)> on_line;  ///< one object, without line end
  std::function<void(const ListenStatus&)> on_status;    ///< a few times a second
  std::function<bool()> stop;                            ///< asked between reads
};

/// Runs until the source ends or `stop` says so. Throws takt::Error where the source cannot be opened, or its format
/// cannot be found.
[[nodiscard]] ListenStatus listen(const ListenJob& job);

}  // namespace takt
