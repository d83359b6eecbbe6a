// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/streams/clock_events.h"

/// Streams that share a trigger, or a strobe: which samples belong together when some are lost and all are late.
namespace takt {

/// One sample of a triggered sensor: its own stamp (its own clock) and when the host received it.
struct TriggeredSample {
  std::int64_t sensor_ns = 0;
  std::int64_t arrival_ns = 0;
};

struct TriggerMatch {
  std::size_t a = 0, b = 0;      ///< indices into both streams
  std::int64_t received_ns = 0;  ///< the earlier arrival: nearer to the trigger for both
};
struct TriggerSyncResult {
  std::vector<TriggerMatch> matches;
  std::size_t lost_a = 0, lost_b = 0;  ///< triggers that one stream has no sample for, between its first and last
  double period_a_s = 0, period_b_s = 0;
  bool ambiguous = true;  ///< the arrivals do not tell which shift is right
  std::string why;
};
/// TriggerSync [English2015]: samples are numbered by the intervals of their own stamps, so that a lost one leaves a
/// hole; the shift between the two numberings is the one that brings the arrivals together.
[[nodiscard]] TriggerSyncResult match_triggers(std::span<const TriggeredSample> a, std::span<const TriggeredSample> b);

/// A frame as the camera's driver hands it over.
struct FrameNote {
  std::int64_t stamp_ns = 0;  ///< the camera's own
  double exposure_s = 0;      ///< 0 where it does not say
};
struct FramePairing {
  std::vector<std::optional<std::size_t>> strobe_of;  ///< one a frame; nothing where it is not certain
  std::size_t lost_strobes = 0, lost_frames = 0;
  std::size_t disagreements = 0;  ///< frames whose width or interval contradicted the count, and were paired anew
  bool ambiguous = true;
  std::string why;
};
/// Pairs frames with the strobes of their exposure and goes on checking: each frame's interval to the one before and
/// its exposure must be those of its strobe. After a drop on either side the count is found again; frames for which it
/// is not are left without a strobe. Never by four equal offsets and then by faith.
[[nodiscard]] FramePairing pair_frames(std::span<const FrameNote> frames, const StrobeStream& strobes);

/// When to trigger cameras so that the middles of their exposures coincide [Nikolic2014]: `middle_s` less half of each
/// exposure and less the camera's own delay from trigger to exposure.
[[nodiscard]] std::vector<double> compensated_triggers(double middle_s, std::span<const double> exposures_s,
                                                       std::span<const double> delays_s);

}  // namespace takt
