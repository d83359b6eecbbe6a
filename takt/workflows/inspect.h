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

}  // namespace takt
