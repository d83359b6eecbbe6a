// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "takt/recording/files.h"
#include "takt/recording/format.h"

/// MCAP files: chunks uncompressed, lz4 or zstd; messages of sensor_msgs in ROS 1's serialization, CDR or JSON.
namespace takt {

[[nodiscard]] bool looks_like_mcap(const std::string& path);
[[nodiscard]] Recording read_mcap(const std::string& path, const OpenOptions& options);
[[nodiscard]] Recording read_mcap(std::shared_ptr<const ByteSource> bytes, const std::string& path);

/// A streamed copy, one chunk in memory at a time. Records in which nothing changes are copied byte for byte; indexes,
/// places and checksums are corrected.
[[nodiscard]] Restamped restamp_mcap(const std::string& in, const std::string& out, const Restamping& order,
                                     const OpenOptions& options);

}  // namespace takt
