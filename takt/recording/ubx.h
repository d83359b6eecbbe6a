// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "takt/streams/clock_events.h"

/// u-blox' binary messages of time: NAV-PVT, NAV-TIMEGPS, NAV-TIMEUTC, NAV-TIMELS, NAV-CLOCK, TIM-TP, TIM-TM2.
namespace takt {

/// The 8-bit Fletcher sum of `bytes` (class to payload's end), CK_A in the low byte.
[[nodiscard]] std::uint16_t ubx_checksum(std::span<const std::byte> bytes);

/// "NAV-PVT"; "UBX-01-03" for messages that takt does not read.
[[nodiscard]] std::string ubx_name(std::uint8_t message_class, std::uint8_t id);

/// Appends what a verified message says to `out`; messages that are too short for their kind say nothing.
void read_ubx(std::uint8_t message_class, std::uint8_t id, std::span<const std::byte> payload,
              std::optional<std::int64_t> arrival_ticks, std::uint64_t byte, LabelStream& out);

}  // namespace takt
