// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "takt/time/instant.h"

namespace takt {

/// What a video file holds, known from its packets alone: nothing is decoded.
struct MediaIndex {
  /// One frame each, in order of presentation. `ticks` is the same instant in the container's own time base, by which
  /// a decoded picture is found again.
  std::vector<Stamp> stamps;
  std::vector<std::int64_t> ticks;
  int width = 0, height = 0;  ///< as coded
  std::string codec;          ///< "h264"
  double rotation_deg = 0;    ///< by which a player is asked to turn the picture, counter-clockwise
  /// One payload of a telemetry track: it covers [start, start + duration) of the media time.
  struct Payload {
    Stamp start;
    Duration duration{0};
    std::string bytes;
  };
  std::vector<Payload> telemetry;  ///< GoPro's `gpmd` track; empty without one
  std::vector<std::string> notes;  ///< what is missing or odd, in words
};

/// Reads all packets of the video and of the telemetry track. Edit lists are honoured: time 0 is where a player starts.
/// Throws takt::Error where there is no video, no readable packet, or no presentation times.
[[nodiscard]] MediaIndex index_media(const std::string& path);

}  // namespace takt
