// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

#include "takt/recording/format.h"
#include "takt/recording/open_in_part.h"

/// The folder of the ASL dataset format (EuRoC, TUM-VI): `mav0/camN`, `mav0/imuN`, or the folder that holds those.
/// Stamps are ns; every sensor shares one clock. docs/cli.md lists the extra keys of sensor.yaml.
namespace takt {

[[nodiscard]] bool looks_like_asl(const std::string& path);
[[nodiscard]] Recording read_asl(const std::string& path, const OpenOptions& options);
/// Goes on without IMUs that cannot be read, as long as there is one that can; see open_recording_in_part.
[[nodiscard]] Recording read_asl_in_part(const std::string& path, const OpenOptions& options,
                                         std::vector<UnreadableStream>& unreadable);

/// The text files of one camera folder; the last two may be empty.
struct AslCameraFiles {
  std::string_view data_csv;
  std::string_view sensor_yaml;
  std::string_view exposure_csv;
};
/// From memory; `folder` is where the pictures are and what errors name. What is to be said is added to `notes`.
[[nodiscard]] CameraStream read_asl_camera(const AslCameraFiles& files, const std::string& name,
                                           const std::string& folder, std::vector<std::string>& notes);
[[nodiscard]] ImuStream read_asl_imu(std::string_view data_csv, std::string_view sensor_yaml, const std::string& name,
                                     const std::string& folder, std::vector<std::string>& notes);

/// The folder with other stamps in a sensor's data.csv, and in its exposure.csv, which goes by the same stamps.
/// Pictures keep their names. Throws takt::Error where no sensor has that name.
[[nodiscard]] Restamped restamp_asl(const std::string& in, const std::string& out, const Restamping& order,
                                    const OpenOptions& options);

}  // namespace takt
