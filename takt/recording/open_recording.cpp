// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/open_recording.h"

#include <fmt/core.h>

#include <filesystem>

#include "takt/error.h"
#include "takt/recording/asl.h"
#include "takt/recording/csv_log.h"
#include "takt/recording/cut.h"
#include "takt/recording/frame_folder.h"
#include "takt/recording/gateware.h"
#include "takt/recording/gcsv.h"
#include "takt/recording/gopro.h"
#include "takt/recording/mcap.h"
#include "takt/recording/kalibr_folder.h"
#include "takt/recording/kitti_raw.h"
#include "takt/recording/ros1_bag.h"
#include "takt/recording/rosbag2.h"
#include "takt/recording/tracks_folder.h"
#include "takt/recording/video_reader.h"
#include "takt/recording/video_with_log.h"

namespace takt {

const std::vector<Format>& formats() {
  // Folders first, then files by their first bytes; a bare log is tried last because any text might be one.
  static const std::vector<Format> table{
      {"ASL folder", looks_like_asl, read_asl, restamp_asl},
      {"tracks folder", looks_like_tracks_folder, read_tracks_folder, restamp_tracks_folder},
      {"rosbag2 folder", looks_like_rosbag2_folder, read_rosbag2_folder, restamp_rosbag2_folder},
      {"frame folder", looks_like_frame_folder, read_frame_folder, restamp_frame_folder},
      {"Kalibr folder", looks_like_kalibr_folder, read_kalibr_folder, restamp_kalibr_folder},
      {"KITTI raw drive", looks_like_kitti_raw, read_kitti_raw, restamp_kitti_raw},
      {"video with log", is_video_with_log, read_video_with_log},
      {"picture folder", looks_like_picture_folder, read_picture_folder},
      {"GoPro video", is_gopro, read_gopro},
      {"video", is_video, read_video},
      {"ROS 1 bag", looks_like_ros1_bag, read_ros1_bag, restamp_ros1_bag},
      {"MCAP", looks_like_mcap, read_mcap, restamp_mcap},
      {"rosbag2 database", looks_like_db3, read_db3, restamp_db3},
      {"compressed rosbag2 file", looks_like_zstd_bag, read_zstd_bag, restamp_zstd_bag},
      {"gateware capture", looks_like_gateware, read_gateware},
      {"gyroflow log", looks_like_gcsv, read_gcsv, restamp_gcsv},
      {"CSV log", looks_like_csv_log, read_csv_log, restamp_csv_log},
  };
  return table;
}

namespace {

const Format& format_of(const std::string& path) {
  std::error_code failed;
  if (!std::filesystem::exists(path, failed)) throw Error("no such file or folder", path, "check the path");
  for (const Format& format : formats())
    if (format.sniff(path)) return format;
  std::string known;
  for (const Format& format : formats()) known += (known.empty() ? "" : ", ") + std::string(format.name);
  const char* kind = std::filesystem::is_directory(path, failed) ? "folder" : "file";
  throw Error(std::string("no known format of recording in this ") + kind, path, "takt reads: " + known);
}

}  // namespace

Recording open_recording(const std::string& path, const OpenOptions& options) {
  const Format& format = format_of(path);
  Recording recording = format.read(path, options);
  recording.path = path;
  recording.format = format.name;
  cut(recording, options.from_s, options.to_s);
  return recording;
}

Restamped restamp_recording(const std::string& in, const std::string& out, const Restamping& order,
                            const OpenOptions& options) {
  const Format& format = format_of(in);
  if (!format.restamp)
    throw Error(fmt::format("a {} cannot be written with other stamps", format.name), in,
                "hand the offset to the tool that reads it: takt export");
  return format.restamp(in, out, order, options);
}

}  // namespace takt
