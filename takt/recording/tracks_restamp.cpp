// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include "takt/recording/folder_restamp.h"
#include "takt/recording/tracks_folder.h"

namespace takt {

Restamped restamp_tracks_folder(const std::string& in, const std::string& out, const Restamping& order,
                                const OpenOptions&) {
  StreamFiles files;
  std::error_code failed;
  constexpr std::string_view of_camera = "_tracks.csv", of_imu = ".csv";
  for (const auto& entry : std::filesystem::directory_iterator(in, failed)) {
    const std::string file = entry.path().filename().string();
    if (file.starts_with("cam") && file.ends_with(of_camera))
      files.emplace_back(file.substr(0, file.size() - of_camera.size()), file);
    else if (file.starts_with("imu") && file.ends_with(of_imu))
      files.emplace_back(file.substr(0, file.size() - of_imu.size()), file);
  }
  std::sort(files.begin(), files.end());
  RestampLog log;
  copy_folder(in, out, tables_to_rewrite(files, in, order, log));
  return {log.streams(), {}};
}

}  // namespace takt
