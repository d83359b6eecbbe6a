// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/handheld_parameters.h"

#include <charconv>
#include <numbers>

namespace takt {

namespace {

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
  require_none_negative(p);
  require_within("outliers", p.outliers, 0, 0.99);
  require_within("misses", p.misses, 0, 0.99);
  require_within("duration_s", p.duration_s, 0.1, 86400);
  require_within("drift_ppm", p.drift_ppm, -10000, 10000);
  require_within("offset_s", p.offset_s, -1e9, 1e9);
  require_within("landmarks", p.landmarks, 0, 1e6);
  if (p.field_of_view_deg) require_within("field_of_view_deg", *p.field_of_view_deg, 5, p.fisheye ? 200 : 150);
  if (p.tracks && p.frames.exposure_swing > 0 && p.frames.stamp != "middle")
    throw_bad_value("exposure_swing", parameter_text(p.frames.exposure_swing),
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
  o.camera.readout_s = p.rolling_shutter_s;
  apply(p.frames, o.camera, o.image_noise);
  o.tracking = {p.landmarks, p.pixel_noise_px, p.outliers, p.track_length, p.misses};
  apply(p.imu, o.imu);
  return o;
}

}  // namespace takt
