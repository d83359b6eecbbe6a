// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/error.h"
#include "takt/recording/format.h"

namespace takt {

/// A stream that is there but cannot be read, and why.
struct UnreadableStream {
  std::string name;
  Error why;
};

struct RecordingInPart {
  Recording recording;
  std::vector<UnreadableStream> unreadable;
};

/// As open_recording, but an IMU that cannot be read beside others that can does not fail them: of an ASL folder, where
/// each has its own file. Throws takt::Error where none can be read, and for whatever open_recording does.
[[nodiscard]] RecordingInPart open_recording_in_part(const std::string& path, const OpenOptions& options = {});

}  // namespace takt
