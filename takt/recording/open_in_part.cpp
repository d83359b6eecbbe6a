// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/open_in_part.h"

#include "takt/recording/asl.h"
#include "takt/recording/cut.h"
#include "takt/recording/open_recording.h"

namespace takt {

RecordingInPart open_recording_in_part(const std::string& path, const OpenOptions& options) {
  RecordingInPart out;
  if (!looks_like_asl(path)) {
    out.recording = open_recording(path, options);
    return out;
  }
  out.recording = read_asl_in_part(path, options, out.unreadable);
  out.recording.path = path;
  out.recording.format = "ASL folder";
  cut(out.recording, options.from_s, options.to_s);
  return out;
}

}  // namespace takt
