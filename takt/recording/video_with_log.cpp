// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/video_with_log.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>

#include "takt/error.h"
#include "takt/recording/gopro.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/video_reader.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

struct Pair {
  std::string video, log;
};

bool is_log(const fs::path& file) {
  return file.extension() == ".csv" || file.extension() == ".gcsv";
}

std::optional<Pair> beside(const fs::path& video) {
  std::error_code failed;
  for (const char* ext : {".gcsv", ".csv"})
    if (const fs::path log = fs::path(video).replace_extension(ext); fs::is_regular_file(log, failed))
      return Pair{video.string(), log.string()};
  return std::nullopt;
}

/// Just one of each: with more it would be a guess which belong together.
std::optional<Pair> inside(const fs::path& folder) {
  std::vector<std::string> videos, logs;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    if (!entry.is_regular_file(failed)) continue;
    if (is_log(entry.path())) {
      logs.push_back(entry.path().string());
    } else if (is_video(entry.path().string())) {
      videos.push_back(entry.path().string());
    }
  }
  if (videos.size() != 1 || logs.size() != 1) return std::nullopt;
  return Pair{videos[0], logs[0]};
}

std::optional<Pair> pair_at(const std::string& path) {
  std::error_code failed;
  if (fs::is_directory(path, failed)) return inside(path);
  return is_video(path) ? beside(path) : std::nullopt;
}

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

}  // namespace

bool is_video_with_log(const std::string& path) {
  return pair_at(path).has_value();
}

Recording read_video_with_log(const std::string& path, const OpenOptions& options) {
  const std::optional<Pair> pair = pair_at(path);
  if (!pair) throw Error("no video with a log beside it", path, "name both alike: ride.mp4 and ride.csv");
  Recording recording = is_gopro(pair->video) ? read_gopro(pair->video, options) : read_video(pair->video, options);
  OpenOptions whole = options;  // cut once, with all streams together
  whole.from_s = whole.to_s = std::nullopt;
  Recording log = open_recording(pair->log, whole);
  append(recording.imus, log.imus);
  append(recording.angles, log.angles);
  append(recording.files, log.files);
  append(recording.notes, log.notes);
  return recording;
}

}  // namespace takt
