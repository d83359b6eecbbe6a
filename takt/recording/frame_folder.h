// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <unordered_map>

#include "takt/recording/format.h"

/// A phone's recording as a folder: numbered pictures (`frames/RE_frame-99.jpg`), `framestamp.txt` with one stamp [s] a
/// line for the whole recording, `gyro.txt` with x,y,z [rad/s], t [s], and, where the recorder wrote it,
/// `gyro_dump.txt` with the start and the exposure of each frame. Pictures and gyro share the phone's clock.
namespace takt {

[[nodiscard]] bool looks_like_frame_folder(const std::string& path);
/// Throws takt::Error. `options.frame_shift` says how numbers pair with stamps.
[[nodiscard]] Recording read_frame_folder(const std::string& path, const OpenOptions& options);

/// The folder with other stamps: a camera's in framestamp.txt and in the recorder's log, the gyro's in gyro.txt.
[[nodiscard]] Restamped restamp_frame_folder(const std::string& in, const std::string& out, const Restamping& order,
                                             const OpenOptions& options);

/// What the recorder logged for one frame.
struct LoggedFrame {
  Stamp start;  ///< of the frame: when its first row begins to expose
  double exposure_s = 0;
};
/// Lines `SOF  4328040426246,  frameNum :1 exp time 0.005248` (µs, s) by frame number; other lines are passed over.
[[nodiscard]] std::unordered_map<std::int64_t, LoggedFrame> read_frame_log(std::string_view text);

/// The last run of digits in a file's name without its extension: "RE_frame-99" -> 99.
[[nodiscard]] std::optional<std::int64_t> number_in(std::string_view stem);

}  // namespace takt
