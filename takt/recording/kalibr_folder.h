// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

#include "takt/recording/format.h"

/// Kalibr's folder, as its bag creator takes it: `camN/<ns>.png`, `imuN.csv` with a header
/// `timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z` (ns, rad/s, m/s²). Or a folder of pictures alone, for
/// the calibration of lenses: its pictures in order of name are one camera without stamps of its own.
namespace takt {

[[nodiscard]] bool looks_like_kalibr_folder(const std::string& path);
[[nodiscard]] Recording read_kalibr_folder(const std::string& path, const OpenOptions& options);

/// The IMU's file from memory; throws takt::Error with file and line.
[[nodiscard]] ImuStream read_kalibr_imu(std::string_view text, const std::string& where);

/// Pictures and nothing else.
[[nodiscard]] bool looks_like_picture_folder(const std::string& path);
[[nodiscard]] Recording read_picture_folder(const std::string& path, const OpenOptions& options);

}  // namespace takt
