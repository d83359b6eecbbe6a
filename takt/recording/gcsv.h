// SPDX-License-Identifier: Apache-2.0
#pragma once
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

}  // namespace takt
