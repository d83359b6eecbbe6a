// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/provenance.h"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>

#include "takt/error.h"
#include "takt/library_versions.h"
#include "takt/version.h"
#include "takt/workflows/sha256.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

/// More files than this in one folder are named together.
constexpr std::size_t many_files = 16;

Provenance::Input together(const std::string& folder, const std::vector<fs::path>& files) {
  Sha256 list;
  for (const fs::path& file : files)
    list.update(fmt::format("{}  {}\n", sha256_of_file(file.string()), file.filename().string()));
  return {fmt::format("{}/* ({} files)", folder, files.size()), list.digest()};
}

std::vector<fs::path> files_in(const std::string& folder) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file()) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

std::string sha256_of_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(std::string("cannot be read: ") + std::strerror(errno), path, "");
  Sha256 hash;
  std::vector<char> buffer(1 << 20);
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    hash.update({buffer.data(), static_cast<std::size_t>(in.gcount())});
  }
  if (in.bad()) throw Error("broke off while being read", path, "is the disk well?");
  return hash.digest();
}

Provenance make_provenance(std::string command, const std::vector<std::string>& files,
                           std::optional<std::uint64_t> seed) {
  Provenance p;
  p.version = version;
  p.command = std::move(command);
  p.seed = seed;
  for (const auto& [name, number] : library_versions) p.libraries.push_back({name, number});

  std::map<std::string, std::vector<fs::path>> by_folder;
  for (const std::string& file : files) {
    if (fs::is_directory(file))
      p.inputs.push_back(together(file, files_in(file)));
    else
      by_folder[fs::path(file).parent_path().string()].push_back(file);
  }
  for (auto& [folder, inside] : by_folder) {
    std::sort(inside.begin(), inside.end());
    inside.erase(std::unique(inside.begin(), inside.end()), inside.end());
    if (inside.size() > many_files)
      p.inputs.push_back(together(folder, inside));
    else
      for (const fs::path& file : inside) p.inputs.push_back({file.string(), sha256_of_file(file.string())});
  }
  return p;
}

}  // namespace takt
