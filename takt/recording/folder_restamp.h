// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <map>
#include <string>

namespace takt {

/// Copies a folder with all in it, except that the files named in `rewrite` (by path inside the folder) are written by
/// their functions. Nothing is written where `out` is empty, but the functions are called, with an empty path.
/// Throws takt::Error.
using WriteFile = std::function<void(const std::string& in, const std::string& out)>;
void copy_folder(const std::string& in, const std::string& out, const std::map<std::string, WriteFile>& rewrite);

}  // namespace takt
