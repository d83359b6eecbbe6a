// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "takt/recording/media_index.h"
#include "takt/streams/streams.h"

namespace takt {

/// Decodes the pictures of a video in order of presentation. Each image is the decoder's own luma plane, not a copy
/// (limited or full range as coded); pixel formats without an 8-bit luma plane are converted.
/// `exposures_s` is empty or one a frame. The reader keeps a handle of `index`.
/// Throws takt::Error where the file cannot be opened or no decoder knows its codec.
[[nodiscard]] std::unique_ptr<FrameReader> read_frames(const std::string& path, std::shared_ptr<const MediaIndex> index,
                                                       std::vector<double> exposures_s, int threads);

}  // namespace takt
