// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace takt::cli {

/// What can be found out before an hour of copying a recording. Throws takt::Error.
void check_output_place(const std::string& in, const std::string& out, bool writes_folder);

/// Beside the output and with its ending: formats that look at a file's name see the same.
[[nodiscard]] std::filesystem::path temporary_name(const std::string& out);

}  // namespace takt::cli
