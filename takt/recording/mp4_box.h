// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace takt {

/// The contents of the first box at a path of an MP4 file, as {"moov", "udta", "GPMF"}; empty where there is none,
/// where it is cut short or larger than `limit`. libav does not hand out boxes that it does not know.
[[nodiscard]] std::vector<std::byte> mp4_box(const std::string& path, std::span<const std::string_view> box_path,
                                             std::size_t limit = std::size_t{1} << 24);

}  // namespace takt
