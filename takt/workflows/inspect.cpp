// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/inspect.h"

#include "takt/recording/open_recording.h"

namespace takt {

Inspection inspect(const std::string& path, const OpenOptions& options) {
  const Recording recording = open_recording(path, options);
  return {recording.path, recording.format, audit(recording), recording.notes};
}

}  // namespace takt
