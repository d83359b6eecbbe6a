// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "takt/recording/format.h"

/// gyroflow's own log, `.gcsv`: a header of `key,value` lines with scales and orientation, then t,gx,gy,gz[,ax,ay,az].
/// https://docs.gyroflow.xyz/app/technical-details/gcsv-format
namespace takt {

[[nodiscard]] bool looks_like_gcsv(const std::string& path);
[[nodiscard]] Recording read_gcsv(const std::string& path, const OpenOptions& options);
/// From memory; `path` gives the stream its name.
[[nodiscard]] Recording read_gcsv(std::string_view text, const std::string& path);

/// The table behind the header.
struct GcsvTable {
  std::size_t at = 0;                 ///< of the line that names the columns, in bytes
  std::optional<int> exponent_to_ns;  ///< its times are in 10^exponent ns; nothing where tscale is no power of ten
};
/// `head` holds the file's header. Throws takt::Error.
[[nodiscard]] GcsvTable gcsv_table(std::string_view head, const std::string& where);

/// The log with other numbers in its time column, in its own unit.
[[nodiscard]] Restamped restamp_gcsv(const std::string& in, const std::string& out, const Restamping& order,
                                     const OpenOptions& options);

}  // namespace takt
