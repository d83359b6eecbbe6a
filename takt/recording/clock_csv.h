// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/format.h"
#include "takt/streams/clock_events.h"

/// Tables of clocks: captured pulses, and exchanges between a device and a host. docs/formats/clock.md has the columns.
namespace takt {

struct ClockCsvOptions {
  std::optional<double> tick_hz = {};        ///< of a counter; nothing: found from the spacing, and said
  std::optional<int> counter_bits = {};      ///< nothing: found where the counter wraps
  TimeUnit time_unit = TimeUnit::automatic;  ///< of stamps without a unit in the header
};

/// One pulse a row, or one column of intervals between pulses. Throws takt::Error.
[[nodiscard]] PulseStream read_pulses_csv(const std::string& path, const ClockCsvOptions& options = {});
[[nodiscard]] PulseStream read_pulses_csv(std::string_view text, const std::string& where,
                                          const ClockCsvOptions& options = {});

/// One exchange a row: device,arrival or request,device,response. Throws takt::Error.
[[nodiscard]] PairStream read_pairs_csv(const std::string& path, const ClockCsvOptions& options = {});
[[nodiscard]] PairStream read_pairs_csv(std::string_view text, const std::string& where,
                                        const ClockCsvOptions& options = {});

/// A camera's frames, one a row: t[,exposure], units by the header (ns; exposures with a decimal point in s).
struct FrameTable {
  std::vector<std::int64_t> stamps_ns;
  std::vector<double> exposures_s;  ///< empty, or one a frame
};
[[nodiscard]] FrameTable read_frames_csv(const std::string& path, const ClockCsvOptions& options = {});
[[nodiscard]] FrameTable read_frames_csv(std::string_view text, const std::string& where,
                                         const ClockCsvOptions& options = {});

/// Strobes, one a row: start,end on the counter; in ticks where `tick_hz` is given, else by the header's unit or ns.
[[nodiscard]] StrobeStream read_strobes_csv(const std::string& path, const ClockCsvOptions& options = {});
[[nodiscard]] StrobeStream read_strobes_csv(std::string_view text, const std::string& where,
                                            const ClockCsvOptions& options = {});

/// What a table holds, by its header, else by its number of columns and their growth.
enum class ClockTable { pulses, pairs, other };
[[nodiscard]] ClockTable clock_table_in(const std::string& path);

}  // namespace takt
