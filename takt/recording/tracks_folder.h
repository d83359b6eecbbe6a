// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

#include "takt/recording/format.h"

/// A folder of feature tracks: `camN_tracks.csv` (t_ns,feature_id,u_px,v_px), `imuN.csv`, and `calib.yaml` with a
/// section for each `camN` and for `imu` (or `imuN`).
namespace takt {

[[nodiscard]] bool looks_like_tracks_folder(const std::string& path);
[[nodiscard]] Recording read_tracks_folder(const std::string& path, const OpenOptions& options);

/// From memory. `calib_yaml` may be empty; `name` ("cam0") is its section. A feature that was out of sight in between
/// comes back under a new id, because an id stands for one unbroken track.
[[nodiscard]] TrackStream read_tracks(std::string_view tracks_csv, std::string_view calib_yaml, const std::string& name,
                                      const std::string& folder, std::vector<std::string>& notes);

/// A rig without its data: cameras and the IMU's noise as `calib.yaml` (from memory) has them, every stream empty.
[[nodiscard]] Recording read_rig(std::string_view calib_yaml, const std::string& where);

/// The folder with other stamps in camN_tracks.csv or imuN.csv.
[[nodiscard]] Restamped restamp_tracks_folder(const std::string& in, const std::string& out, const Restamping& order,
                                              const OpenOptions& options);

}  // namespace takt
