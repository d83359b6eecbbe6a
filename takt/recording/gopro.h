// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/recording/format.h"
#include "takt/recording/telemetry.h"

/// GoPro MP4 with its telemetry track (GPMF). All streams are on the clock "media time": 0 is where a player starts.
///   cam0   the video; exposures from SHUT; a frame's stamp is the start of its exposure (gpmf-parser issue 189)
///   GYRO   rates [rad/s] and ACCL [m/s²], interpolated to the gyro's instants, in the camera body's X Y Z
///   CORI   R_start_body of the camera body; IORI: of the stabilised picture against the body
namespace takt {

/// A video with a telemetry track?
[[nodiscard]] bool is_gopro(const std::string& path);
/// Throws takt::Error where the video cannot be read or its telemetry holds nothing that takt knows.
[[nodiscard]] Recording read_gopro(const std::string& path, const OpenOptions& options);

/// The streams of the telemetry alone, and in `notes` how they came to be.
[[nodiscard]] Recording read_telemetry(const Telemetry& telemetry);

/// Takes a stored 3-vector to the camera body's X Y Z, and why so.
struct StoredAxes {
  Mat3 body_from_stored;
  std::string words;
};
/// From ORIN ("zxY": column 0 is −Z, …), else MTRX and ORIO, else the order in the stream's name, else Z X Y, which is
/// how cameras store that say nothing.
[[nodiscard]] StoredAxes stored_axes(const gpmf::Stream& stream);

}  // namespace takt
