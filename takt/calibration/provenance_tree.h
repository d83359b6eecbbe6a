// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "takt/calibration/estimate.h"
#include "takt/calibration/tree.h"

namespace takt::tree {

/// `provenance` as every result has it (docs/formats/result.md).
[[nodiscard]] Node provenance(const Provenance& p);

}  // namespace takt::tree
