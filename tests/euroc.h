// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <sstream>
#include <string>

#include "takt/recording/files.h"
#include "takt/time/instant.h"
#include "tests/tools.h"

namespace takt::testing_tools {

/// A copy of EuRoC's folder whose cam0 has its stamps moved; the pictures are links.
inline std::string euroc_with_stamps_moved(const TemporaryFolder& folder, Duration by) {
  const std::string name = "by" + std::to_string(by.count());
  const std::filesystem::path from = std::filesystem::path(real_data("euroc_micro/mav0")),
                              to = std::filesystem::path(folder.path()) / name / "mav0";
  std::filesystem::create_directories(to / "cam0");
  std::filesystem::create_symlink(from / "imu0", to / "imu0");
  std::filesystem::create_symlink(from / "cam0/data", to / "cam0/data");
  std::filesystem::create_symlink(from / "cam0/sensor.yaml", to / "cam0/sensor.yaml");
  std::istringstream rows(read_file((from / "cam0/data.csv").string()));
  std::string moved, line;
  while (std::getline(rows, line)) {
    const auto comma = line.find(',');
    if (line.starts_with('#') || comma == std::string::npos)
      moved += line + "\n";
    else
      moved += std::to_string(std::stoll(line.substr(0, comma)) + by.count()) + line.substr(comma) + "\n";
  }
  const std::filesystem::path written = folder.file(name + "/mav0/cam0/data.csv", moved);
  return written.parent_path().parent_path().parent_path().string();
}

}  // namespace takt::testing_tools
