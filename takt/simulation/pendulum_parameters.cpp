// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/pendulum_parameters.h"

#include <fmt/core.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;

ExposureInstant instant_of(const std::string& stamp) {
  if (stamp == "start" || stamp == "begin") return ExposureInstant::start;
  if (stamp == "middle") return ExposureInstant::middle;
  if (stamp == "end") return ExposureInstant::end;
  throw std::invalid_argument("stamp: \"" + stamp + "\" is none of start, middle, end");
}

void check_within(const char* field, double value, double least, double most) {
  if (!(value >= least && value <= most))
    throw std::invalid_argument(
        fmt::format("{}: '{:g}' does not lie between {:g} and {:g}", field, value, least, most));
}

/// What would run for ever, fill the disk, or be no pendulum.
void check_parameters(const PendulumParameters& p) {
  const auto check = [](const char* field, const std::optional<double>& value, double least, double most) {
    if (value) check_within(field, *value, least, most);
  };
  check("duration_s", p.duration_s, 0.1, 86400);
  check("start_angle_deg", p.start_angle_deg, 0, 120);
  check("length_m", p.length_m, 0.01, 100);
  check("frame_rate_hz", p.frame_rate_hz, 1, 1e4);
  check("exposure_s", p.exposure_s, 0, 1 / p.frame_rate_hz.value_or(DialCameraModel{}.frame_rate_hz));
  check("angle_noise_deg", p.angle_noise_deg, 0, 90);
  check("gyro_noise_rad_s", p.gyro_noise_rad_s, 0, 10);
  check("gyro_range_rad_s", p.gyro_range_rad_s, 0, 1e4);
  check("filter_delay_s", p.filter_delay_s, 0, 1);
  check("transport_s", p.transport_s, -1, 1);
  check("temperature_c", p.temperature_c, -100, 200);
  check_within("rolling_shutter_s", p.rolling_shutter_s, 0, 1);
  check_within("yaw_deg", p.yaw_deg, -45, 45);
  check_within("pitch_deg", p.pitch_deg, -45, 45);
  check_within("imus", p.imus, 1, 100);
}

}  // namespace

PendulumRig to_rig(const PendulumParameters& p) {
  check_parameters(p);
  PendulumRig rig = pendulum_rig(p.rig);
  rig.duration_s = p.duration_s.value_or(rig.duration_s);
  if (p.start_angle_deg) rig.start_angle_rad = *p.start_angle_deg * deg;
  rig.pendulum.viscous_per_s = p.viscous_per_s.value_or(rig.pendulum.viscous_per_s);
  rig.pendulum.coulomb_rad_s2 = p.coulomb_rad_s2.value_or(rig.pendulum.coulomb_rad_s2);
  rig.pendulum.quadratic_per_rad = p.quadratic_per_rad.value_or(rig.pendulum.quadratic_per_rad);
  if (p.length_m) rig.pendulum.natural_rad_s = std::sqrt(9.80665 / *p.length_m);
  rig.camera.frame_rate_hz = p.frame_rate_hz.value_or(rig.camera.frame_rate_hz);
  rig.camera.exposure_s = p.exposure_s.value_or(rig.camera.exposure_s);
  rig.camera.stamp = instant_of(p.stamp);
  if (p.angle_noise_deg) rig.camera.angle_noise_rad = *p.angle_noise_deg * deg;
  if (p.rest_reading_deg) rig.camera.rest_reading_rad = *p.rest_reading_deg * deg;
  rig.camera.line_delay_s = p.rolling_shutter_s / rig.camera.rows;
  rig.wobble.amplitude_rad = p.wobble_deg * deg;
  GyroModel gyro = rig.imus.front();
  gyro.output_rate_hz = p.output_rate_hz.value_or(gyro.output_rate_hz);
  gyro.filter_delay_s = p.filter_delay_s.value_or(gyro.filter_delay_s);
  gyro.transport_s = p.transport_s.value_or(gyro.transport_s);
  gyro.temperature_c = p.temperature_c.value_or(gyro.temperature_c);
  gyro.noise_density = p.gyro_noise_rad_s.value_or(gyro.noise_density);
  gyro.full_scale_rad_s = p.gyro_range_rad_s.value_or(gyro.full_scale_rad_s);
  rig.imus.assign(static_cast<std::size_t>(p.imus), gyro);
  for (std::size_t i = 0; i < rig.imus.size(); ++i) rig.imus[i].name = "imu" + std::to_string(i);
  return rig;
}

DialScene to_scene(const PendulumParameters& p) {
  if (p.dial != "coded" && p.dial != "plain")
    throw std::invalid_argument("dial: \"" + p.dial + "\" is neither coded nor plain");
  DialScene scene = dial_scene(p.dial == "coded" ? DialKind::coded : DialKind::plain);
  if (!(p.camera_distance_m >= 0 && p.camera_distance_m < p.dial_radius_m))
    throw std::invalid_argument("camera_distance_m must be less than dial_radius_m: the camera looks outward");
  scene.dial.radius_m = scene.view.radius_m = p.dial_radius_m;
  scene.view.pivot_distance_m = p.camera_distance_m;
  scene.view.roll_rad = p.roll_deg * deg;
  scene.view.yaw_rad = p.yaw_deg * deg;
  scene.view.pitch_rad = p.pitch_deg * deg;
  scene.noise = {p.read_noise, p.shot_noise};
  scene.vignetting = p.vignetting;
  check(scene.dial);
  return scene;
}

}  // namespace takt
