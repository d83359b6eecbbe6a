// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>

#include "takt/streams/clock_events.h"
#include "takt/workflows/clock.h"

namespace takt {

/// Where a board's clock stands on UTC, where that is known.
using BoardToReference = std::function<DisciplinedStamp(std::int64_t board_ns)>;

/// Frames against the middles of their strobes, on the board's clock or through it on UTC.
[[nodiscard]] ClockOutcome relate_frames(const std::string& path, const StrobeStream& strobes,
                                         const ClockCsvOptions& options, const std::string& reference,
                                         const BoardToReference& to_reference);

/// Frames against the exposures or triggers that a receiver stamped itself (TIM-TM2), on UTC or GPS time.
[[nodiscard]] ClockOutcome relate_marked_frames(const ClockJob& job, const std::vector<LabelStream>& logs);

/// Each event that a receiver stamped: its stamp on GPS time, and on the job's reference.
[[nodiscard]] std::vector<PulseStamp> event_stamps(const ClockJob& job, const LabelStream& log);

/// Two sensors that share a trigger: the first against the second, by matched samples; each against the host by the
/// earlier of both arrivals, beside it.
[[nodiscard]] ClockOutcome relate_triggered(const ClockJob& job);

}  // namespace takt
