// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/recording/format.h"

/// Kalibr's folder, as its bag creator takes it: `camN/<ns>.png`, `imuN.csv` with a header
/// `timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z` (ns, rad/s, m/s²). Or a folder of pictures alone, for
/// the calibration of lenses: its pictures in order of name are one camera without stamps of its own.
namespace takt {

[[nodiscard]] bool looks_like_kalibr_folder(const std::string& path);
[[nodiscard]] Recording read_kalibr_folder(const std::string& path, const OpenOptions& options);

/// The IMU's file from memory; throws takt::Error with file and line.
[[nodiscard]] ImuStream read_kalibr_imu(std::string_view text, const std::string& where);

/// camN/ by number, its pictures by name, imuN.csv by number.
[[nodiscard]] std::vector<std::filesystem::path> kalibr_cameras(const std::filesystem::path& root);
[[nodiscard]] std::vector<std::filesystem::path> pictures_in(const std::filesystem::path& folder);
[[nodiscard]] std::vector<std::filesystem::path> kalibr_imus(const std::filesystem::path& root);
/// Kalibr takes the digits before and after the ninth from the end as seconds and nanoseconds: a whole number.
[[nodiscard]] std::optional<Stamp> stamp_in_name(const std::filesystem::path& picture);

/// The folder with other stamps: an IMU's in its file, a camera's as the names of its pictures.
[[nodiscard]] Restamped restamp_kalibr_folder(const std::string& in, const std::string& out, const Restamping& order,
                                              const OpenOptions& options);

/// Pictures and nothing else.
[[nodiscard]] bool looks_like_picture_folder(const std::string& path);
[[nodiscard]] Recording read_picture_folder(const std::string& path, const OpenOptions& options);

}  // namespace takt
