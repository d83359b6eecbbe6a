// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <type_traits>

#include "takt/simulation/camera.h"
#include "takt/simulation/imu.h"
#include "takt/simulation/parameters.h"
#include "takt/simulation/sensor_noise.h"

/// How a camera takes its frames and how an IMU measures, as scenario files and the command line write them: what all
/// simulations of a camera and an IMU share.
namespace takt {

struct FrameParameters {
  double frame_rate_hz = SimulatedCamera{}.rate_hz;
  double exposure_s = SimulatedCamera{}.exposure_s;
  double exposure_swing = 0;
  std::string stamp = "middle";
  double jitter_s = 0;
  double drop = 0;
  double read_noise = ImageNoise{}.read, shot_noise = ImageNoise{}.shot;
};

template <class Visitor>
void describe(FrameParameters& p, Visitor& v) {
  v("frame_rate_hz", p.frame_rate_hz, "frames a second");
  v("exposure_s", p.exposure_s, "exposure time");
  v("exposure_swing", p.exposure_swing, "auto-exposure: fraction by which the exposure varies");
  v("stamp", p.stamp, "what a frame's stamp means: start, middle or end of the exposure");
  v("jitter_s", p.jitter_s, "sigma of the frames' stamps");
  v("drop", p.drop, "fraction of the frames that never arrive");
  v("read_noise", p.read_noise, "sigma of a dark pixel in grey levels");
  v("shot_noise", p.shot_noise, "variance added for each grey level");
}

struct ImuParameters {
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
void describe(ImuParameters& p, Visitor& v) {
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

/// Each throws std::invalid_argument naming the parameter that no simulation can have.
void apply(const FrameParameters& p, SimulatedCamera& camera, ImageNoise& noise);
void apply(const ImuParameters& p, SimulatedImu& imu);

void require_within(const std::string& field, double value, double low, double high);
void require_not_negative(const std::string& field, double value);

/// No number of a description may be negative but offsets, steps, drifts and delays.
template <class Struct>
void require_none_negative(Struct p) {
  auto look = [](const std::string& field, const auto& value, const std::string&) {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>)
      require_not_negative(field, static_cast<double>(value));
  };
  describe(p, look);
}

}  // namespace takt
