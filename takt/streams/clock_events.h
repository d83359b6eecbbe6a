// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/time/instant.h"

/// What clocks are compared by: edges captured on a counter, whole seconds that a receiver names, exchanges of stamps.
namespace takt {

/// A free-running counter that stamps events: takt never steers it, a map is estimated instead.
struct DeviceCounter {
  std::string clock;     ///< name of the device's clock: "board"
  double tick_hz = 1e9;  ///< nominal; 1e9 where stamps are nanoseconds
  int bits = 64;         ///< ticks are modulo 2^bits; 64: already extended
};

/// Which edge was captured.
enum class Edge : std::uint8_t { unknown, rising, falling };

/// One captured edge: a 1PPS, a data-ready line, a trigger. An edge at true time t gives the last tick at or before it,
/// so the edge lies in [ticks, ticks + 1).
struct Pulse {
  std::int64_t ticks = 0;
  Edge edge = Edge::unknown;
  std::optional<std::uint32_t> sequence;    ///< the channel's own number: a hole is an edge that was lost
  std::optional<std::int64_t> width_ticks;  ///< to the edge back, where both were captured
};

struct PulseStream {
  std::string name;  ///< "pps", "imu0"
  DeviceCounter counter;
  std::vector<Pulse> pulses;  ///< as captured: wraps, false and missing edges are the estimator's work
  std::vector<std::string> notes;

  [[nodiscard]] std::size_t size() const { return pulses.size(); }
};

/// Both edges of the same frame's exposure strobe, on one counter. The frame's stamp is their middle.
struct FrameStrobe {
  std::int64_t start_ticks = 0;
  std::int64_t end_ticks = 0;
  std::optional<std::uint32_t> sequence;
};

struct StrobeStream {
  std::string name;  ///< "cam0"
  DeviceCounter counter;
  std::vector<FrameStrobe> strobes;

  [[nodiscard]] std::size_t size() const { return strobes.size(); }
};

/// The scale on which a receiver names an instant: Instant<Utc> or Instant<Gps> of takt/time/time_scales.h.
enum class LabelScale : std::uint8_t { utc, gps };

/// An instant named by a receiver's message.
struct TimeLabel {
  std::string source;  ///< "RMC", "ZDA", "GGA", "NAV-PVT", "NAV-TIMEGPS", "NAV-TIMEUTC", "TIM-TP"
  LabelScale scale = LabelScale::utc;
  std::int64_t time_ns = 0;  ///< ns since the scale's epoch; with fractions where the message has them
  bool valid = false;        ///< the receiver vouches for the time
  bool leap_second = false;  ///< the message says 23:59:60; time_ns then repeats 23:59:59
  bool names_next = false;   ///< the pulse to come (TIM-TP) rather than the one that has been
  /// Whether the receiver vouches for the leap seconds in a UTC label; empty: the format cannot say (NMEA).
  std::optional<bool> leap_resolved;
  std::optional<int> gps_minus_utc_s;         ///< the leap seconds that the receiver applied, where they show
  std::optional<std::int64_t> arrival_ticks;  ///< when the first bit of the message came, on the pulses' counter
  std::uint64_t byte = 0;                     ///< where the message begins in its file
};

/// What a receiver says of the error of one of its pulses (TIM-TP's qErr).
/// The pulse comes at (named second) + error: u-blox counts a pulse that is late as positive; verified at run time.
struct PulseError {
  LabelScale scale = LabelScale::gps;
  std::int64_t time_ns = 0;  ///< the pulse's whole second on that scale
  double error_s = 0;
  std::uint64_t byte = 0;
};

/// What a receiver knows of leap seconds (NAV-TIMELS).
struct LeapNotice {
  std::int64_t gps_ns = 0;       ///< when it was said, modulo a week where no week is known
  std::optional<int> current_s;  ///< GPS − UTC, where the receiver vouches for it
  std::optional<int> change_s;   ///< +1, −1, 0: the next or last event
  std::optional<std::int32_t> seconds_to_event;
};

/// An external event stamped by the receiver (TIM-TM2).
struct EventMark {
  int channel = 0;
  std::uint16_t count = 0;  ///< of rising edges
  LabelScale scale = LabelScale::gps;
  std::optional<std::int64_t> rising_ns;  ///< on that scale
  std::optional<std::int64_t> falling_ns;
  double accuracy_s = 0;
  bool valid = false;
};

/// All that a GNSS receiver said.
struct LabelStream {
  std::string name;
  std::vector<TimeLabel> labels;  ///< in the order of the file
  std::vector<PulseError> pulse_errors;
  std::vector<LeapNotice> leap_notices;
  std::vector<EventMark> events;
  /// Messages by name ("GNRMC", "NAV-PVT"), all that passed their checksum; and what was passed over.
  struct Count {
    std::string message;
    std::size_t count = 0;
  };
  std::vector<Count> counts;
  std::size_t broken = 0;         ///< messages whose checksum is wrong
  std::size_t garbage_bytes = 0;  ///< bytes outside any message
  std::vector<std::string> notes;
};

/// One exchange between a device and a host: device stamp and arrival (one-way), or the host's request, the device's
/// stamp while answering, and the response's arrival (two-way). Requests and arrivals are on the host's clock.
struct ClockPair {
  std::int64_t request_ns = 0;  ///< only in two-way streams
  std::int64_t device_ns = 0;
  std::int64_t arrival_ns = 0;
};

struct PairStream {
  std::string name;
  std::string device = "device", host = "host";
  bool two_way = false;
  std::vector<ClockPair> pairs;
  std::vector<std::string> notes;

  [[nodiscard]] std::size_t size() const { return pairs.size(); }
};

/// How far an estimated stamp may be trusted.
/// locked: pulses or exchanges confirm it now; holdover: predicted since they stopped; ambiguous: the whole second is
/// not known.
enum class ClockState : std::uint8_t { locked, holdover, ambiguous };
[[nodiscard]] constexpr const char* to_string(ClockState s) {
  return s == ClockState::locked ? "locked" : s == ClockState::holdover ? "holdover" : "ambiguous";
}

/// An instant of the device's clock on the reference clock: value, σ, hard bounds where there are any, state.
struct DisciplinedStamp {
  std::int64_t reference_ns = 0;
  double sigma_s = 0;
  std::optional<std::int64_t> lower_ns, upper_ns;  ///< the truth lies between, whatever the noise's distribution
  ClockState state = ClockState::ambiguous;
};

}  // namespace takt
