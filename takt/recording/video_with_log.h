// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/recording/format.h"

/// A video and a gyro log side by side: `ride.mp4` with `ride.csv` or `ride.gcsv`, or a folder with just one video and
/// one log. The camera comes from the video (with its telemetry, if it is a GoPro's), the IMU from the log; each keeps
/// its own clock.
namespace takt {

[[nodiscard]] bool is_video_with_log(const std::string& path);
/// Throws takt::Error.
[[nodiscard]] Recording read_video_with_log(const std::string& path, const OpenOptions& options);

}  // namespace takt
