// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace takt {

/// Where a new folder is built until it is finished and gets its name: what an interrupt has to remove.
[[nodiscard]] std::string half_written(const std::string& folder);

}  // namespace takt
