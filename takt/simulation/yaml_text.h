// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "takt/streams/streams.h"

/// The pieces of text that the written folders share.
namespace takt {

/// EuRoC's matrix block, readable by OpenCV and by yaml-cpp.
[[nodiscard]] std::string transform_yaml(const std::string& key, const Mat4& T);
/// stamp, exposure_s, readout_s, shutter: one a line.
[[nodiscard]] std::string timing_yaml(const FrameTiming& timing, const std::string& indent);
/// t_ns,wx,wy,wz[,ax,ay,az] with the shortest digits that read back the same.
void append_imu_rows(const ImuStream& imu, std::string& csv);

}  // namespace takt
