// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"

namespace takt {

/// What is needed to make a result again: takt's version and libraries, the command, and each input's SHA-256.
/// Folders, and many files in one folder (a camera's pictures), become one input: the SHA-256 of what `sha256sum *`
/// prints there. Throws takt::Error where a file cannot be read.
[[nodiscard]] Provenance make_provenance(std::string command, const std::vector<std::string>& files,
                                         std::optional<std::uint64_t> seed);

/// SHA-256 of a file's bytes.
[[nodiscard]] std::string sha256_of_file(const std::string& path);

}  // namespace takt
