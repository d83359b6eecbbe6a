// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "takt/error.h"

/// What the fuzz targets share: bytes go into a reader, and only takt::Error may come out of it.
namespace takt::fuzz {

template <class Read>
int reads_or_says_why(const std::uint8_t* data, std::size_t size, Read read) {
  try {
    read(std::string_view(reinterpret_cast<const char*>(data), size));
  } catch (const Error&) {
    // That is an answer. Anything else ends the run and is a bug.
  }
  return 0;
}

/// What `write(path)` writes into a file of that ending.
template <class Write>
std::string written_as(const std::string& ending, Write write) {
  const auto path = std::filesystem::temp_directory_path() / ("takt-seed-" + std::to_string(::getpid()) + ending);
  write(path.string());
  std::ifstream in(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  in.close();
  std::filesystem::remove(path);
  return bytes;
}

/// Writes small valid inputs into the first folder on the command line, from where libFuzzer starts.
inline int plant_seeds(int argc, char** argv, const std::vector<std::string>& seeds) {
  for (int i = 1; i < argc; ++i) {
    if (argv[i][0] == '-' || !std::filesystem::is_directory(argv[i])) continue;
    for (std::size_t n = 0; n < seeds.size(); ++n)
      std::ofstream(std::filesystem::path(argv[i]) / ("seed" + std::to_string(n)), std::ios::binary) << seeds[n];
    break;
  }
  return 0;
}

}  // namespace takt::fuzz
