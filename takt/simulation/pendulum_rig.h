// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/motion/pendulum.h"
#include "takt/streams/streams.h"

namespace takt {

/// A gyro after the MPU9250: samples at 1 kHz, low-pass, decimation to the output rate, interrupt.
///
/// Its output delay is the sum of what happens to a slow motion on the way to the interrupt's stamp:
///   low-pass     two equal one-pole sections; `filter_delay_s` is their group delay at zero frequency
///   decimation   mean of the last N samples, N = sample rate / output rate: (N − 1)/2 sample intervals
///   readout      `readout_share` of the interval by which the output is slower than the sampling
///   transport    interrupt to stamp, constant
///   temperature  [Fu2021] fig. 11
/// Table 4 of [Fu2021] is a line of slope 1.42 in the output interval: the mean explains 0.5 of it, and the default
/// of `readout_share` the rest. How the device really divides it, the paper does not say.
struct GyroModel {
  std::string name = "imu0";
  double sample_rate_hz = 1000;
  double output_rate_hz = 1000;  ///< a whole fraction of the sample rate
  double filter_delay_s = 2.9e-3;
  double readout_share = 0.92;
  double transport_s = 0.43e-3;
  double temperature_c = 46;
  double noise_density = 1.7453e-4;  ///< rad/s/√Hz (0.01 °/s/√Hz); white before the low-pass, σ = density·√rate
  double scale = 1;
  Vec3 bias_rad_s = Vec3(0.004, -0.006, 0.003);
  Vec3 axis = Vec3::UnitY();    ///< the pivot's direction in the IMU's frame
  double full_scale_rad_s = 0;  ///< readings are clipped here; 0: never
  double resolution_rad_s = 0;  ///< of one count; 0: continuous
};

/// What the temperature adds to the delay, against 46 °C: rises to a maximum at 40 °C, then falls a little.
[[nodiscard]] double temperature_delay_s(double celsius);

/// The delay from a motion of this angular frequency to the stamp of the sample that shows it: the phase delay of
/// the whole chain. This is the truth that a rig is to find. At a pendulum's frequency it differs from the group delay
/// by less than 0.1 µs, and the dying of the swings moves it by less than 0.2 µs.
[[nodiscard]] double output_delay_s(const GyroModel& gyro, double angular_frequency_rad_s);

/// The camera and what reads the dial in its frames, at the level of angles.
struct DialCameraModel {
  std::string name = "cam0";
  double frame_rate_hz = 50;
  double exposure_s = 1e-3;
  ExposureInstant stamp = ExposureInstant::middle;
  double angle_noise_rad = 5.236e-5;  ///< 0.003°, white
  double rest_reading_rad = 0;        ///< Δθ: what the dial shows at rest
  int rows = 480;
  int bands = 1;            ///< readings a frame, from bands of rows one above the other
  double line_delay_s = 0;  ///< from row to row; 0: global shutter
};

/// The bob turning on its rod, excited by the release. The IMU feels all of it, the dial shows a share.
struct BobWobble {
  double amplitude_rad = 0;
  double frequency_hz = 6;
  double decay_s = 4;
  double dial_share = 0.3;
};

/// The bob's own angle at a time after the release (rad).
[[nodiscard]] double wobble_angle(const BobWobble& wobble, double t);

struct PendulumRig {
  std::string name = "ordinary";
  PendulumModel pendulum{.coulomb_rad_s2 = 0.01};
  double start_angle_rad = 0.2618;  ///< 15°
  double duration_s = 60;
  DialCameraModel camera;
  std::vector<GyroModel> imus{GyroModel{}};
  BobWobble wobble;
  std::int64_t epoch_ns = 1'700'000'000'000'000'000;  ///< stamp of the release
};

/// "ordinary", "viscous", "bearing", "drag", "small", "tilted", "paper"; throws std::invalid_argument for another.
[[nodiscard]] PendulumRig pendulum_rig(const std::string& name);
[[nodiscard]] const std::vector<std::string>& pendulum_rig_names();

struct PendulumRecording {
  AngleStream dial;
  std::vector<ImuStream> imus;
  std::vector<Estimate> truth;  ///< one an IMU: sensor is the camera, reference the IMU
};

/// Angles and rates as the rig's sensors give them. The sampling phases of the sensors are drawn from the seed too.
[[nodiscard]] PendulumRecording simulate_pendulum(const PendulumRig& rig, std::uint64_t seed);

}  // namespace takt
