// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>

#include "takt/recording/format.h"

/// rosbag2: its SQLite files (.db3), a file compressed as a whole (.db3.zstd, .mcap.zstd), and its folders with
/// metadata.yaml and one or more files in any of its storages.
namespace takt {

[[nodiscard]] bool looks_like_db3(const std::string& path);
[[nodiscard]] Recording read_db3(const std::string& path, const OpenOptions& options);
[[nodiscard]] Recording read_db3(std::span<const std::byte> bytes, const std::string& path);
/// A copy in which the stamps of one topic's messages are written over, in place.
[[nodiscard]] Restamped restamp_db3(const std::string& in, const std::string& out, const Restamping& order,
                                    const OpenOptions& options);

[[nodiscard]] bool looks_like_zstd_bag(const std::string& path);
[[nodiscard]] Recording read_zstd_bag(const std::string& path, const OpenOptions& options);
[[nodiscard]] Restamped restamp_zstd_bag(const std::string& in, const std::string& out, const Restamping& order,
                                         const OpenOptions& options);

[[nodiscard]] bool looks_like_rosbag2_folder(const std::string& path);
[[nodiscard]] Recording read_rosbag2_folder(const std::string& path, const OpenOptions& options);
[[nodiscard]] Restamped restamp_rosbag2_folder(const std::string& in, const std::string& out, const Restamping& order,
                                               const OpenOptions& options);

}  // namespace takt
