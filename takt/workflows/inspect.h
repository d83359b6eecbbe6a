// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "takt/recording/format.h"
#include "takt/streams/audit.h"

namespace takt {

/// What a recording holds and what is wrong with it.
struct Inspection {
  std::string path;
  std::string format;
  std::vector<StreamAudit> streams;
  std::vector<std::string> notes;  ///< what reading assumed and repaired
};

/// Opens the recording and audits each stream; no picture is decoded. Throws takt::Error where it cannot be opened.
[[nodiscard]] Inspection inspect(const std::string& path, const OpenOptions& options = {});

/// What the index of a bag, an MCAP file or a rosbag2 database tells of all its topics: counts, rates and gaps by the
/// recorder's clock, without reading a message. Throws takt::Error where there is none.
[[nodiscard]] Inspection inspect_index(const std::string& path);

}  // namespace takt
