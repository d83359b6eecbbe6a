// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/simulation/handheld.h"
#include "takt/simulation/parameters.h"

namespace takt {

/// HandheldOptions as a scenario file and the command line write them: flat, each name with its unit.
struct HandheldParameters {
  std::string motion = "handheld";
  double duration_s = HandheldOptions{}.duration_s;
  std::optional<double> turn_rms_rad_s, speed_rms_m_s;
  std::optional<double> go_s, stop_s;
  double offset_s = HandheldOptions{}.offset_s;
  double drift_ppm = 0;
  double step_s = 0, step_at_s = 30;
  bool stereo = false;
  double stereo_offset_s = 0.0015;
  bool tracks = false;

  double frame_rate_hz = SimulatedCamera{}.rate_hz;
  std::string resolution = "640x480";
  bool radtan = false, fisheye = false;
  std::optional<double> field_of_view_deg;
  double exposure_s = SimulatedCamera{}.exposure_s;
  double exposure_swing = 0;
  std::string stamp = "middle";
  double rolling_shutter_s = 0;
  double jitter_s = 0;
  double drop = 0;
  double read_noise = ImageNoise{}.read, shot_noise = ImageNoise{}.shot;

  double pixel_noise_px = SimulatedTracking{}.pixel_noise_px;
  double outliers = 0;
  int landmarks = SimulatedTracking{}.landmarks;
  double track_length = SimulatedTracking{}.mean_length;
  double misses = SimulatedTracking{}.miss_fraction;

  double imu_rate_hz = SimulatedImu{}.rate_hz;
  double gyro_noise = SimulatedImu{}.noise.gyro_density, gyro_walk = SimulatedImu{}.noise.gyro_random_walk;
  double accel_noise = SimulatedImu{}.noise.accel_density, accel_walk = SimulatedImu{}.noise.accel_random_walk;
  double gyro_bias_rad_s = SimulatedImu{}.gyro_bias_rad_s, accel_bias_m_s2 = SimulatedImu{}.accel_bias_m_s2;
  double imu_scale = 0, imu_misalignment_rad = 0;
  std::string low_pass = "none";
  double bandwidth_hz = SimulatedImu{}.bandwidth_hz;
  double imu_stamp_delay_s = 0, imu_jitter_s = 0, imu_drop = 0;
  double gyro_step_rad_s = 0, gyro_range_rad_s = 0, accel_step_m_s2 = 0, accel_range_m_s2 = 0;
};

template <class Visitor>
void describe(HandheldParameters& p, Visitor& v) {
  v("motion", p.motion,
    "handheld, rig, car, stops, fast, weak, still, single_axis, single_tone, translation_only, constant_rate, "
    "constant_velocity");
  v("duration_s", p.duration_s, "length of the recording");
  v("turn_rms_rad_s", p.turn_rms_rad_s, "rms angular rate; the motion's own when left out");
  v("speed_rms_m_s", p.speed_rms_m_s, "rms speed; the motion's own when left out");
  v("go_s", p.go_s, "how long it moves before it stops; the motion's own when left out");
  v("stop_s", p.stop_s, "how long it then stands; 0: it never stops");
  v("offset_s", p.offset_s, "clocks: reference - sensor in the middle of the recording");
  v("drift_ppm", p.drift_ppm, "clocks: how much faster the reference runs");
  v("step_s", p.step_s, "by which the offset jumps once");
  v("step_at_s", p.step_at_s, "when it jumps, after the start");
  v("stereo", p.stereo, "a second camera, cam1, 0.11 m to the right");
  v("stereo_offset_s", p.stereo_offset_s, "cam1's offset less cam0's");
  v("tracks", p.tracks, "write feature tracks instead of images");
  v("frame_rate_hz", p.frame_rate_hz, "frames a second");
  v("resolution", p.resolution, "width x height");
  v("radtan", p.radtan, "a lens with EuRoC's radial-tangential distortion");
  v("fisheye", p.fisheye, "an equidistant fisheye lens");
  v("field_of_view_deg", p.field_of_view_deg, "horizontal; 70, or 120 for the fisheye, when left out");
  v("exposure_s", p.exposure_s, "exposure time");
  v("exposure_swing", p.exposure_swing, "auto-exposure: fraction by which the exposure varies");
  v("stamp", p.stamp, "what a frame's stamp means: start, middle or end of the exposure");
  v("rolling_shutter_s", p.rolling_shutter_s, "readout from the first row to the last; 0: global shutter");
  v("jitter_s", p.jitter_s, "sigma of the frames' stamps");
  v("drop", p.drop, "fraction of the frames that never arrive");
  v("read_noise", p.read_noise, "sigma of a dark pixel in grey levels");
  v("shot_noise", p.shot_noise, "variance added for each grey level");
  v("pixel_noise_px", p.pixel_noise_px, "tracks: sigma of u and of v");
  v("outliers", p.outliers, "tracks: fraction seen 5 to 50 px away");
  v("landmarks", p.landmarks, "tracks: points on the walls of the room");
  v("track_length", p.track_length, "tracks: frames until a feature is lost, in the mean");
  v("misses", p.misses, "tracks: fraction of the observations not made");
  v("imu_rate_hz", p.imu_rate_hz, "samples a second");
  v("gyro_noise", p.gyro_noise, "density, rad/s/sqrt(Hz)");
  v("gyro_walk", p.gyro_walk, "bias random walk, rad/s^2/sqrt(Hz)");
  v("accel_noise", p.accel_noise, "density, m/s^2/sqrt(Hz)");
  v("accel_walk", p.accel_walk, "bias random walk, m/s^3/sqrt(Hz)");
  v("gyro_bias_rad_s", p.gyro_bias_rad_s, "sigma of the initial bias");
  v("accel_bias_m_s2", p.accel_bias_m_s2, "sigma of the initial bias");
  v("imu_scale", p.imu_scale, "sigma of the scale errors");
  v("imu_misalignment_rad", p.imu_misalignment_rad, "sigma of the axes' tilts");
  v("low_pass", p.low_pass, "in the IMU: none, first_order, second_order, fir");
  v("bandwidth_hz", p.bandwidth_hz, "bandwidth of the low-pass");
  v("imu_stamp_delay_s", p.imu_stamp_delay_s, "by which IMU stamps are late, besides the low-pass");
  v("imu_jitter_s", p.imu_jitter_s, "sigma of the IMU's stamps");
  v("imu_drop", p.imu_drop, "fraction of the IMU samples that never arrive");
  v("gyro_step_rad_s", p.gyro_step_rad_s, "quantisation; 0: none");
  v("gyro_range_rad_s", p.gyro_range_rad_s, "saturation; 0: none");
  v("accel_step_m_s2", p.accel_step_m_s2, "quantisation; 0: none");
  v("accel_range_m_s2", p.accel_range_m_s2, "saturation; 0: none");
}

/// Throws std::invalid_argument naming the parameter that no simulation can have.
[[nodiscard]] HandheldOptions to_options(const HandheldParameters& p);

}  // namespace takt
