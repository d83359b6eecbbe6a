// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/handheld_parameters.h"

#include <array>
#include <charconv>
#include <numbers>
#include <stdexcept>
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

void read_resolution(const std::string& text, int& width, int& height) {
  const char *const begin = text.data(), *const end = begin + text.size();
  const auto [cross, bad_width] = std::from_chars(begin, end, width);
  if (bad_width == std::errc{} && cross != end && *cross == 'x') {
    const auto [rest, bad_height] = std::from_chars(cross + 1, end, height);
    if (bad_height == std::errc{} && rest == end && width >= 16 && height >= 16 && width <= 8192 && height <= 8192)
      return;
  }
  throw_bad_value("resolution", text, "is not WIDTHxHEIGHT between 16x16 and 8192x8192");
}

/// The ranges outside which the words of the description lose their meaning.
void check(const HandheldParameters& p) {
  HandheldParameters copy = p;
  const auto within = [](const std::string& field, double value, double low, double high) {
    if (!(value >= low && value <= high))
      throw_bad_value(field, parameter_text(value),
                      "does not lie between " + parameter_text(low) + " and " + parameter_text(high));
  };
  auto not_negative = [](const std::string& field, const auto& value, const std::string&) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
      if (value < 0 && field != "offset_s" && field != "step_s" && field != "stereo_offset_s" && field != "drift_ppm" &&
          field != "imu_stamp_delay_s")
        throw_bad_value(field, parameter_text(value), "is negative");
    }
  };
  describe(copy, not_negative);
  for (const auto& [field, fraction] : {std::pair{"drop", p.drop},
                                        {"outliers", p.outliers},
                                        {"misses", p.misses},
                                        {"imu_drop", p.imu_drop},
                                        {"exposure_swing", p.exposure_swing}})
    within(field, fraction, 0, 0.99);
  within("duration_s", p.duration_s, 0.1, 86400);
  within("frame_rate_hz", p.frame_rate_hz, 0.1, 10000);
  within("imu_rate_hz", p.imu_rate_hz, 1, 100000);
  within("drift_ppm", p.drift_ppm, -10000, 10000);
  within("offset_s", p.offset_s, -1e9, 1e9);
  within("landmarks", p.landmarks, 0, 1e6);
  if (p.field_of_view_deg) within("field_of_view_deg", *p.field_of_view_deg, 5, p.fisheye ? 200 : 150);
  if (p.tracks && p.exposure_swing > 0 && p.stamp != "middle")
    throw_bad_value("exposure_swing", parameter_text(p.exposure_swing),
                    "cannot be told by tracks, which have one exposure for all frames: stamp the middle");
  if (p.radtan && p.fisheye) throw_bad_value("fisheye", "true", "and radtan are two lenses: choose one");
}

}  // namespace

HandheldOptions to_options(const HandheldParameters& p) {
  check(p);
  HandheldOptions o;
  o.duration_s = p.duration_s;
  o.motion = find_motion(p.motion);
  if (p.turn_rms_rad_s) o.motion.turn_calm_rad_s = o.motion.turn_lively_rad_s = *p.turn_rms_rad_s;
  if (p.speed_rms_m_s) o.motion.speed_calm_m_s = o.motion.speed_lively_m_s = *p.speed_rms_m_s;
  if (p.go_s) o.motion.go_s = *p.go_s;
  if (p.stop_s) o.motion.stop_s = *p.stop_s;
  if (o.motion.stop_s > 0 && !(o.motion.go_s > 0))
    throw_bad_value("stop_s", parameter_text(o.motion.stop_s), "needs a go_s: how long it moves in between");
  o.offset_s = p.offset_s;
  o.drift = 1e-6 * p.drift_ppm;
  o.step_s = p.step_s;
  o.step_at_s = p.step_at_s;
  o.stereo = p.stereo;
  o.stereo_offset_s = p.stereo_offset_s;
  o.footage = p.tracks ? Footage::tracks : Footage::images;

  read_resolution(p.resolution, o.camera.width, o.camera.height);
  o.camera.lens = p.fisheye ? Distortion::equidistant : p.radtan ? Distortion::radtan : Distortion::none;
  o.camera.fov_rad = p.field_of_view_deg.value_or(0) * std::numbers::pi / 180;
  o.camera.rate_hz = p.frame_rate_hz;
  o.camera.exposure_s = p.exposure_s;
  o.camera.exposure_swing = p.exposure_swing;
  o.camera.stamp = one_of("stamp", p.stamp, instants);
  o.camera.readout_s = p.rolling_shutter_s;
  o.camera.jitter_s = p.jitter_s;
  o.camera.drop_fraction = p.drop;
  o.image_noise = {p.read_noise, p.shot_noise};
  o.tracking = {p.landmarks, p.pixel_noise_px, p.outliers, p.track_length, p.misses};

  o.imu.rate_hz = p.imu_rate_hz;
  o.imu.noise = {p.gyro_noise, p.gyro_walk, p.accel_noise, p.accel_walk};
  o.imu.gyro_bias_rad_s = p.gyro_bias_rad_s;
  o.imu.accel_bias_m_s2 = p.accel_bias_m_s2;
  o.imu.scale_error = p.imu_scale;
  o.imu.misalignment_rad = p.imu_misalignment_rad;
  o.imu.low_pass = one_of("low_pass", p.low_pass, low_passes);
  o.imu.bandwidth_hz = p.bandwidth_hz;
  o.imu.stamp_delay_s = p.imu_stamp_delay_s;
  o.imu.jitter_s = p.imu_jitter_s;
  o.imu.drop_fraction = p.imu_drop;
  o.imu.gyro_step_rad_s = p.gyro_step_rad_s;
  o.imu.gyro_range_rad_s = p.gyro_range_rad_s;
  o.imu.accel_step_m_s2 = p.accel_step_m_s2;
  o.imu.accel_range_m_s2 = p.accel_range_m_s2;
  return o;
}

}  // namespace takt
