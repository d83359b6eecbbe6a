// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/paper_batch.h"

#include "takt/estimators/batch/batch.h"
#include "takt/simulation/simulated_corners.h"

namespace takt::paper {

namespace {

constexpr double recording_s = 8;
constexpr double accel_density = 2.9e-3;  // m/s²/√Hz: 300 µg/√Hz, the MPU9250's data sheet

TargetFilmOptions free_motion(const PendulumRig& rig, std::uint64_t seed) {
  const GyroModel& gyro = rig.imus.front();
  TargetFilmOptions o;
  o.seed = seed;
  o.duration_s = recording_s;
  o.offset_s = 0;
  o.camera.rate_hz = rig.camera.frame_rate_hz;
  o.camera.exposure_s = rig.camera.exposure_s;
  o.camera.stamp = rig.camera.stamp;
  o.imu.rate_hz = gyro.output_rate_hz;
  o.imu.noise.gyro_density = gyro.noise_density;
  o.imu.noise.accel_density = accel_density;
  o.imu.stamp_delay_s = output_delay_s(gyro, rig.pendulum.natural_rad_s);
  return o;
}

}  // namespace

BatchDelay batch_delay(const PendulumRig& rig, std::uint64_t seed) {
  const TargetFilmOptions options = free_motion(rig, seed);
  SimulatedBoard run = simulate_board(options);
  BatchDelay out;
  out.truth = 1e3 * (to_seconds(*run.truth.offset) + run.cameras[0].timing.to_exposure_middle_s(rig.camera.exposure_s));
  run.cameras[0].timing.instant = ExposureInstant::middle;
  const Estimate e = calibrate_batch(run.cameras[0], run.imus[0], {.threads = 1});
  out.verdict = e.verdict;
  if (!e.answered()) return out;
  out.delay = 1e3 * to_seconds(*e.offset);
  out.sigma = 1e3 * *e.sigma_s;
  return out;
}

}  // namespace takt::paper
