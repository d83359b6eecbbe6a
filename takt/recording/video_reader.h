// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "takt/recording/format.h"
#include "takt/recording/media_index.h"

namespace takt {

/// Is this a video by its first bytes (MP4, MOV, MKV, WebM, AVI)?
[[nodiscard]] bool is_video(const std::string& path);

/// "cam0" on the clock "media time" (0 is where a player starts), decoded when asked for. `exposures_s` is empty or one
/// a frame.
[[nodiscard]] CameraStream video_camera(const std::string& path, const std::shared_ptr<const MediaIndex>& index,
                                        const std::vector<double>& exposures_s, const OpenOptions& options);

/// A bare video: one camera. Throws takt::Error.
[[nodiscard]] Recording read_video(const std::string& path, const OpenOptions& options);

}  // namespace takt
