// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/yaml_text.h"

#include <fmt/format.h>

#include <iterator>

namespace takt {

std::string transform_yaml(const std::string& key, const Mat4& T) {
  std::string out = key + ":\n  cols: 4\n  rows: 4\n  data: [";
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      out += fmt::format("{}{}", T(r, c), r == 3 && c == 3 ? "]\n" : c == 3 ? ",\n         " : ", ");
  return out;
}

std::string timing_yaml(const FrameTiming& timing, const std::string& indent) {
  const char* const instant = timing.instant == ExposureInstant::start ? "start"
                              : timing.instant == ExposureInstant::end ? "end"
                                                                       : "middle";
  return fmt::format("{0}exposure_s: {1}\n{0}stamp: {2}\n{0}readout_s: {3}\n{0}shutter: {4}\n", indent,
                     timing.exposure_s, instant, timing.readout_s,
                     timing.shutter == Shutter::rolling ? "rolling" : "global");
}

void append_imu_rows(const ImuStream& imu, std::string& csv) {
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const Vec3& w = imu.gyro_rad_s[i];
    fmt::format_to(std::back_inserter(csv), "{},{},{},{}", to_ns(imu.stamps[i]), w.x(), w.y(), w.z());
    if (!imu.accel_m_s2.empty()) {
      const Vec3& a = imu.accel_m_s2[i];
      fmt::format_to(std::back_inserter(csv), ",{},{},{}", a.x(), a.y(), a.z());
    }
    csv += '\n';
  }
}

}  // namespace takt
