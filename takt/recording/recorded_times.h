// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/recording/message_file.h"

namespace takt {

/// When the messages of each topic of a bag, an MCAP file or a rosbag2 database were recorded, from its index alone:
/// however large the file is, no message is read. Throws takt::Error where there is no such index.
[[nodiscard]] std::vector<RecordedTimes> recorded_times(const std::string& path);

}  // namespace takt
