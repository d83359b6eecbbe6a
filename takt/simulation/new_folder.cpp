// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include "takt/error.h"
#include "takt/simulation/folder_writer.h"

namespace fs = std::filesystem;

namespace takt {

fs::path unfinished(const std::string& folder) {
  fs::path path = fs::path(folder).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  path += ".unfinished";
  return path;
}

NewFolder::NewFolder(std::string folder) : folder_(std::move(folder)), building_(unfinished(folder_)) {
  std::error_code failed;
  if (fs::exists(folder_, failed) && !(fs::is_directory(folder_, failed) && fs::is_empty(folder_, failed)))
    throw Error("is already there", folder_, "choose another folder or remove it");
  fs::remove_all(building_, failed);  // left by a crash
  fs::create_directories(building_, failed);
  if (failed) throw Error(failed.message(), building_.string(), "choose a folder that can be written");
}

NewFolder::~NewFolder() {
  std::error_code failed;
  if (!finished_) fs::remove_all(building_, failed);
}

void NewFolder::write(const std::string& name, const std::string& content) const {
  // The folder itself is not made again: where it is gone, the work was called off.
  std::error_code failed;
  fs::path folder = building_;
  for (const fs::path& part : fs::path(name).parent_path()) fs::create_directory(folder /= part, failed);
  const fs::path path = building_ / name;
  std::ofstream out(path, std::ios::binary);
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  out.close();
  if (!out) throw Error("cannot be written", path.string(), "is the disk full?");
}

void NewFolder::finish() {
  std::error_code failed;
  fs::remove(folder_, failed);  // an empty one
  fs::rename(building_, fs::path(folder_), failed);
  if (failed) throw Error(failed.message(), folder_, "choose a folder that can be written");
  finished_ = true;
}

}  // namespace takt
