// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/simulation/dial_renderer.h"
#include "takt/simulation/parameters.h"
#include "takt/simulation/pendulum_rig.h"

namespace takt {

/// PendulumRig as a scenario file and the command line write it. What is left empty is the named rig's.
struct PendulumParameters {
  std::string rig = "ordinary";
  std::optional<double> duration_s, start_angle_deg;
  std::optional<double> viscous_per_s, coulomb_rad_s2, quadratic_per_rad, length_m;
  std::optional<double> frame_rate_hz, exposure_s, angle_noise_deg, rest_reading_deg;
  std::string stamp = "middle";
  int imus = 1;
  bool angles = false;
  std::string dial = "coded";
  double dial_radius_m = Dial{}.radius_m, camera_distance_m = DialView{}.pivot_distance_m;
  double roll_deg = 0, yaw_deg = 0, pitch_deg = 0;
  double rolling_shutter_s = 0, wobble_deg = 0;
  double read_noise = ImageNoise{}.read, shot_noise = ImageNoise{}.shot, vignetting = DialScene{}.vignetting;
  std::optional<double> output_rate_hz, filter_delay_s, transport_s, temperature_c, gyro_noise_rad_s, gyro_range_rad_s;
};

template <class Visitor>
void describe(PendulumParameters& p, Visitor& v) {
  v("rig", p.rig, "ordinary, viscous, bearing, drag, small, tilted or paper");
  v("duration_s", p.duration_s, "length of the recording");
  v("start_angle_deg", p.start_angle_deg, "angle of the release");
  v("viscous_per_s", p.viscous_per_s, "viscous drag");
  v("coulomb_rad_s2", p.coulomb_rad_s2, "dry friction of the bearing");
  v("quadratic_per_rad", p.quadratic_per_rad, "drag with the square of the speed");
  v("length_m", p.length_m, "pivot to centre of mass");
  v("frame_rate_hz", p.frame_rate_hz, "camera");
  v("exposure_s", p.exposure_s, "exposure time");
  v("stamp", p.stamp, "start, middle or end of the exposure");
  v("angle_noise_deg", p.angle_noise_deg, "noise of one angle");
  v("rest_reading_deg", p.rest_reading_deg, "what the dial shows at rest");
  v("angles", p.angles, "write the dial's angles instead of pictures of it");
  v("dial", p.dial, "coded, or plain: graduations alone");
  v("dial_radius_m", p.dial_radius_m, "pivot to dial");
  v("camera_distance_m", p.camera_distance_m, "pivot to camera");
  v("roll_deg", p.roll_deg, "camera turned about its axis");
  v("yaw_deg", p.yaw_deg, "camera turned about the pivot's direction");
  v("pitch_deg", p.pitch_deg, "camera turned upward");
  v("rolling_shutter_s", p.rolling_shutter_s, "readout from the first row to the last; 0: global shutter");
  v("wobble_deg", p.wobble_deg, "the bob turning on its rod after the release");
  v("read_noise", p.read_noise, "sigma of a dark pixel in grey levels");
  v("shot_noise", p.shot_noise, "variance added for each grey level");
  v("vignetting", p.vignetting, "how much darker the corners are");
  v("imus", p.imus, "how many IMUs the bob carries");
  v("output_rate_hz", p.output_rate_hz, "1000, 500, 250 or 200");
  v("filter_delay_s", p.filter_delay_s, "group delay of the gyro's low-pass");
  v("transport_s", p.transport_s, "interrupt to stamp");
  v("temperature_c", p.temperature_c, "of the IMU");
  v("gyro_noise_rad_s", p.gyro_noise_rad_s, "density, per root hertz");
  v("gyro_range_rad_s", p.gyro_range_rad_s, "rates are clipped here; 0: never");
}

/// Throws std::invalid_argument naming what no rig can have.
[[nodiscard]] PendulumRig to_rig(const PendulumParameters& p);
/// The dial and the camera before it; throws std::invalid_argument too.
[[nodiscard]] DialScene to_scene(const PendulumParameters& p);

}  // namespace takt
