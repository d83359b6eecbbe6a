// SPDX-License-Identifier: Apache-2.0
#include "cli/output_place.h"

#include <fmt/core.h>
#include <unistd.h>

#include "takt/error.h"

namespace takt::cli {

namespace fs = std::filesystem;

void check_output_place(const std::string& in, const std::string& out, bool writes_folder) {
  std::error_code failed;
  if (!fs::exists(in, failed)) throw Error("no such file or folder", in, "check the path");
  if (fs::equivalent(in, out, failed)) throw Error("is the input itself", out, "choose another name with -o");
  const fs::path folder = fs::absolute(out).parent_path();
  if (!fs::is_directory(folder, failed))
    throw Error("cannot be written: there is no such folder", folder.string(), "make it, or choose another place");
  if (writes_folder && fs::exists(out, failed) && !(fs::is_directory(out, failed) && fs::is_empty(out, failed)))
    throw Error("is there already", out, "remove it, or choose another name with -o");
  if (!writes_folder && fs::is_directory(out, failed))
    throw Error("is a folder", out, "name the file to write with -o");
  if (fs::absolute(out).lexically_normal().string().starts_with(fs::absolute(in).lexically_normal().string() + "/"))
    throw Error("is inside the input", out, "choose another place with -o");
}

fs::path temporary_name(const std::string& out) {
  const fs::path name(out);
  return name.parent_path() / fmt::format(".{}.part{}{}", name.stem().string(), getpid(), name.extension().string());
}

}  // namespace takt::cli
