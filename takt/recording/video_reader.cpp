// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/video_reader.h"

#include "takt/recording/files.h"
#include "takt/recording/video_frames.h"

namespace takt {

bool is_video(const std::string& path) {
  const std::string head = file_head(path, 16);
  if (head.size() < 12) return false;
  const auto has = [&head](std::size_t at, std::string_view magic) {
    return head.compare(at, magic.size(), magic) == 0;
  };
  const bool mp4 = has(4, "ftyp") || has(4, "moov") || has(4, "mdat") || has(4, "wide") || has(4, "skip");
  const bool matroska = has(0, "\x1A\x45\xDF\xA3");
  const bool avi = has(0, "RIFF") && has(8, "AVI ");
  return mp4 || matroska || avi;
}

CameraStream video_camera(const std::string& path, const std::shared_ptr<const MediaIndex>& index,
                          const std::vector<double>& exposures_s, const OpenOptions& options) {
  CameraStream camera;
  camera.name = "cam0";
  camera.clock = "media time";
  camera.stamps = index->stamps;
  camera.timing.rows = index->height;
  camera.exposures_s = exposures_s;
  camera.open = [path, index, exposures_s, threads = options.decode_threads] {
    return read_frames(path, index, exposures_s, threads);
  };
  return camera;
}

Recording read_video(const std::string& path, const OpenOptions& options) {
  const auto index = std::make_shared<const MediaIndex>(index_media(path));
  Recording recording;
  recording.files = {path};
  recording.notes = index->notes;
  recording.notes.push_back(
      "which instant of a frame its presentation time means is not in the file; the middle of the exposure of the "
      "first "
      "row is taken");
  recording.cameras.push_back(video_camera(path, index, {}, options));
  return recording;
}

}  // namespace takt
