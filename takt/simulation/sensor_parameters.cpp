// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/sensor_parameters.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace takt {

namespace {

/// The value of one of the words, or an error that lists them.
template <class Value, std::size_t N>
Value one_of(const std::string& field, const std::string& text,
             const std::array<std::pair<const char*, Value>, N>& words) {
  std::string names;
  for (const auto& [word, value] : words) {
    if (text == word) return value;
    names += (names.empty() ? "" : ", ") + std::string(word);
  }
  throw_bad_value(field, text, "is none of " + names);
}

constexpr std::array<std::pair<const char*, ExposureInstant>, 3> instants{
    {{"start", ExposureInstant::start}, {"middle", ExposureInstant::middle}, {"end", ExposureInstant::end}}};
constexpr std::array<std::pair<const char*, LowPassKind>, 4> low_passes{{{"none", LowPassKind::none},
                                                                         {"first_order", LowPassKind::first_order},
                                                                         {"second_order", LowPassKind::second_order},
                                                                         {"fir", LowPassKind::fir}}};
constexpr std::array<std::string_view, 7> signed_fields{
    "offset_s",         "step_s", "stereo_offset_s", "drift_ppm", "imu_stamp_delay_s", "camera_offset_step_s",
    "imu_offset_step_s"};

}  // namespace

void require_within(const std::string& field, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw_bad_value(field, parameter_text(value),
                    "does not lie between " + parameter_text(low) + " and " + parameter_text(high));
}

void require_not_negative(const std::string& field, double value) {
  if (value < 0 && std::ranges::find(signed_fields, field) == signed_fields.end())
    throw_bad_value(field, parameter_text(value), "is negative");
}

void apply(const FrameParameters& p, SimulatedCamera& camera, ImageNoise& noise) {
  require_none_negative(p);
  require_within("frame_rate_hz", p.frame_rate_hz, 0.1, 10000);
  require_within("drop", p.drop, 0, 0.99);
  require_within("exposure_swing", p.exposure_swing, 0, 0.99);
  camera.rate_hz = p.frame_rate_hz;
  camera.exposure_s = p.exposure_s;
  camera.exposure_swing = p.exposure_swing;
  camera.stamp = one_of("stamp", p.stamp, instants);
  camera.jitter_s = p.jitter_s;
  camera.drop_fraction = p.drop;
  noise = {p.read_noise, p.shot_noise};
}

void apply(const ImuParameters& p, SimulatedImu& imu) {
  require_none_negative(p);
  require_within("imu_rate_hz", p.imu_rate_hz, 1, 100000);
  require_within("imu_drop", p.imu_drop, 0, 0.99);
  imu.rate_hz = p.imu_rate_hz;
  imu.noise = {p.gyro_noise, p.gyro_walk, p.accel_noise, p.accel_walk};
  imu.gyro_bias_rad_s = p.gyro_bias_rad_s;
  imu.accel_bias_m_s2 = p.accel_bias_m_s2;
  imu.scale_error = p.imu_scale;
  imu.misalignment_rad = p.imu_misalignment_rad;
  imu.low_pass = one_of("low_pass", p.low_pass, low_passes);
  imu.bandwidth_hz = p.bandwidth_hz;
  imu.stamp_delay_s = p.imu_stamp_delay_s;
  imu.jitter_s = p.imu_jitter_s;
  imu.drop_fraction = p.imu_drop;
  imu.gyro_step_rad_s = p.gyro_step_rad_s;
  imu.gyro_range_rad_s = p.gyro_range_rad_s;
  imu.accel_step_m_s2 = p.accel_step_m_s2;
  imu.accel_range_m_s2 = p.accel_range_m_s2;
}

}  // namespace takt
