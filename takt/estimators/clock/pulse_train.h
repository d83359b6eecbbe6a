// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/streams/clock_events.h"

namespace takt {

/// A pulse that belongs to the train, with its number in whole seconds and its place on the counter without wraps.
struct TrainPulse {
  std::int64_t second = 0;  ///< since the segment's first pulse
  std::int64_t ticks = 0;   ///< extended
  std::size_t index = 0;    ///< in the stream
};

/// Pulses that are counted through without doubt. A counter that starts again, or a phase that steps, begins a new one.
struct TrainSegment {
  std::vector<TrainPulse> pulses;
  double ticks_per_second = 0;     ///< median
  std::size_t restarts = 0;        ///< of the counter before this segment
  std::int64_t wrap_ticks = 0;     ///< added to the raw count of its first pulse
  std::vector<std::size_t> slips;  ///< indices of the first pulses after a step of the phase

  /// Where `ticks` falls, in seconds since the segment's first pulse: interpolated, beyond the ends extrapolated.
  [[nodiscard]] double second_at(std::int64_t ticks) const;
};

struct PulseTrain {
  std::vector<TrainSegment> segments;
  double tick_hz = 0;
  int bits = 64;          ///< given, or found where the counter wrapped
  std::size_t edges = 0;  ///< all that were captured of the polarity in use
  std::size_t false_edges = 0;
  std::size_t missing = 0;      ///< seconds within segments that have no pulse
  std::size_t restarts = 0;     ///< of the counter
  std::vector<double> slips_s;  ///< phase steps too small to be another edge: the counter lost or gained time
  std::vector<double> steps_s;  ///< phase steps between segments without a restart
  bool only_falling = false;
  bool two_trains = false;  ///< two edges a second, and nothing says which is the pulse
  std::vector<std::string> words;
};

/// Finds the train of one pulse a second among the captured edges. `falling`: the falling edge is the whole second.
[[nodiscard]] PulseTrain find_pulse_train(const PulseStream& stream, bool falling = false);

/// Raw counts of a free-running counter of `bits` without wraps; a step back that is no wrap is a restart.
struct ExtendedCount {
  std::int64_t ticks = 0;
  std::size_t restarts = 0;
};
class CountExtender {
 public:
  CountExtender(int bits, double tick_hz) : bits_(bits), tick_hz_(tick_hz) {}
  ExtendedCount extend(std::int64_t raw);
  /// The count that `raw` shows nearest to the last one extended, before or behind it.
  [[nodiscard]] std::int64_t nearest(std::int64_t raw) const;

 private:
  int bits_;
  double tick_hz_;
  std::optional<std::int64_t> last_raw_;
  std::int64_t add_ = 0;
  std::size_t restarts_ = 0;
};

}  // namespace takt
