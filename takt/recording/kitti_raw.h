// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/format.h"

/// A drive of KITTI's raw data: `image_0X/timestamps.txt` with one date and time a line for `data/0000000000.png` and
/// on, `oxts/timestamps.txt` for `oxts/data/0000000000.txt` with the inertial unit's row, and the day's `calib_*.txt`
/// beside them or one folder above. Columns and frames as in dataformat.txt and the calibration's notes of the
/// development kit [Geiger2013].
namespace takt {

[[nodiscard]] bool looks_like_kitti_raw(const std::string& path);
[[nodiscard]] Recording read_kitti_raw(const std::string& path, const OpenOptions& options);

/// `2011-09-26 13:02:25.964389445` a line, taken as UTC; nothing for a line that is blank, as KITTI has it where
/// nothing was measured. Throws takt::Error with file and line.
[[nodiscard]] std::vector<std::optional<Stamp>> read_kitti_stamps(std::string_view text, const std::string& where);

/// One such line, without its end; nothing where it is none.
[[nodiscard]] std::optional<Stamp> kitti_stamp(std::string_view line);
/// The folders image_NN of a drive that have stamps, in order.
[[nodiscard]] std::vector<std::filesystem::path> kitti_cameras(const std::filesystem::path& root);

/// The drive with other dates in a sensor's timestamps.txt.
[[nodiscard]] Restamped restamp_kitti_raw(const std::string& in, const std::string& out, const Restamping& order,
                                          const OpenOptions& options);

/// One row of the inertial unit: accelerations x y z in its columns 12 to 14 (m/s²), rates x y z in 18 to 20 (rad/s),
/// both along the unit's own axes: forward, left, up. Throws takt::Error.
struct OxtsSample {
  Vec3 gyro_rad_s;
  Vec3 accel_m_s2;
};
[[nodiscard]] OxtsSample read_oxts(std::string_view text, const std::string& where);

}  // namespace takt
