// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/half_written.h"

#include "takt/simulation/folder_writer.h"

namespace takt {

std::string half_written(const std::string& folder) {
  return unfinished(folder).string();
}

}  // namespace takt
