// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "takt/streams/streams.h"

namespace takt {

/// Where a folder is built until it is finished: beside it, so that the final rename is atomic.
[[nodiscard]] std::filesystem::path unfinished(const std::string& folder);

/// A new folder, whole or not at all: built as `unfinished(folder)`, renamed by `finish`, removed when it was not
/// finished. Throws takt::Error; refuses a folder that is already there and not empty.
class NewFolder {
 public:
  explicit NewFolder(std::string folder);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return building_; }
  /// A file of that name, which may have folders before it. From any thread.
  void write(const std::string& name, const std::string& content) const;
  void finish();

 private:
  std::string folder_;
  std::filesystem::path building_;
  bool finished_ = false;
};

/// Called with 0 … 1.
using Progress = std::function<void(double)>;

/// EuRoC's layout: mav0/camN with PNG pictures, exposure.csv where the exposure varies, mav0/imuN, a sensor.yaml each.
/// Pictures are read once, in order, a few at a time; `threads` encode them.
void write_asl(const Recording& recording, const NewFolder& into, int threads, const Progress& progress);

/// imuN.csv, camN_tracks.csv and calib.yaml.
void write_tracks(const Recording& recording, const NewFolder& into);

}  // namespace takt
