// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/pendulum_rig.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include "takt/simulation/random.h"

namespace takt {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double gravity_m_s2 = 9.80665;

/// How many samples make one output.
int decimation(const GyroModel& gyro) {
  const double ratio = gyro.sample_rate_hz / gyro.output_rate_hz;
  const int n = static_cast<int>(std::lround(ratio));
  if (n < 1 || std::abs(ratio - n) > 1e-9)
    throw std::invalid_argument("GyroModel: output rate " + std::to_string(gyro.output_rate_hz) +
                                " Hz is no whole fraction of the sample rate " + std::to_string(gyro.sample_rate_hz) +
                                " Hz");
  return n;
}

/// y += (1 − pole)·(x − y) twice has the group delay 2·pole/(1 − pole) samples at zero frequency.
double pole_of(const GyroModel& gyro) {
  const double samples = 0.5 * gyro.filter_delay_s * gyro.sample_rate_hz;
  return samples / (1 + samples);
}

/// From the newest sample of an output to that output's stamp.
double stamp_latency_s(const GyroModel& gyro) {
  const double slower = 1 / gyro.output_rate_hz - 1 / gyro.sample_rate_hz;
  return gyro.readout_share * slower + gyro.transport_s + temperature_delay_s(gyro.temperature_c);
}

/// The bob's own angle and rate.
struct Wobble {
  double angle, rate;
};
Wobble wobble_at(const BobWobble& w, double t) {
  if (w.amplitude_rad == 0 || t < 0) return {0, 0};
  const double omega = 2 * pi * w.frequency_hz, size = w.amplitude_rad * std::exp(-t / w.decay_s);
  const double s = std::sin(omega * t), c = std::cos(omega * t);
  return {size * s, size * (omega * c - s / w.decay_s)};
}

Stamp stamp_of(const PendulumRig& rig, double t) {
  return from_ns(rig.epoch_ns) + from_seconds(t);
}

AngleStream dial_readings(const PendulumRig& rig, const PendulumMotion& motion, std::uint64_t seed) {
  const DialCameraModel& camera = rig.camera;
  if (camera.bands < 1) throw std::invalid_argument("DialCameraModel: bands must be at least 1");
  Random random(seed, "dial");
  AngleStream dial;
  dial.name = camera.name;
  dial.clock = "rig";
  dial.timing.instant = camera.stamp;
  dial.timing.exposure_s = camera.exposure_s;
  dial.timing.rows = camera.rows;
  dial.timing.readout_s = camera.line_delay_s * camera.rows;
  dial.timing.shutter = camera.line_delay_s == 0 ? Shutter::global : Shutter::rolling;

  const double half = 0.5 * camera.exposure_s, interval = 1 / camera.frame_rate_hz;
  const double to_stamp = -dial.timing.to_exposure_middle_s(camera.exposure_s);
  const double last = motion.duration_s() - half - camera.line_delay_s * camera.rows;
  for (double middle = half + interval * random.uniform(); middle < last; middle += interval)
    for (int band = 0; band < camera.bands; ++band) {
      const double row = camera.bands == 1 ? 0 : camera.rows * (band + 0.5) / camera.bands;
      const double t = middle + row * camera.line_delay_s;
      const double angle =
          motion.mean_angle(t - half, t + half) + rig.wobble.dial_share * wobble_at(rig.wobble, t).angle;
      dial.stamps.push_back(stamp_of(rig, middle + to_stamp));
      dial.angle_rad.push_back(angle + camera.rest_reading_rad + camera.angle_noise_rad * random.normal());
      if (camera.bands > 1) dial.rows.push_back(row);
    }
  return dial;
}

ImuStream gyro_readings(const PendulumRig& rig, const GyroModel& gyro, const PendulumMotion& motion,
                        std::uint64_t seed) {
  Random random(seed, gyro.name);
  ImuStream imu;
  imu.name = gyro.name;
  imu.clock = "rig";
  imu.temperature_c = gyro.temperature_c;
  const int n = decimation(gyro);
  const double pole = pole_of(gyro), interval = 1 / gyro.sample_rate_hz, latency = stamp_latency_s(gyro);
  const double sigma = gyro.noise_density * std::sqrt(gyro.sample_rate_hz);
  const Vec3 axis = gyro.axis.normalized();
  const double length_m = gravity_m_s2 / (rig.pendulum.natural_rad_s * rig.pendulum.natural_rad_s);
  const Vec3 down = axis.unitOrthogonal(), along = axis.cross(down);
  const double phase = interval * random.uniform();
  Vec3 first = Vec3::Zero(), second = Vec3::Zero(), sum = Vec3::Zero();
  int held = 0;
  // The filter settles for a tenth of a second before the release, when the bob is held still.
  for (int k = -100;; ++k) {
    const double t = phase + k * interval;
    if (t + latency >= motion.duration_s()) break;
    const PendulumState bob = t < 0 ? PendulumState{rig.start_angle_rad, 0, 0} : motion.at(t);
    Vec3 rate = axis * (gyro.scale * (bob.rate + wobble_at(rig.wobble, t).rate)) + gyro.bias_rad_s;
    rate += sigma * Vec3(random.normal(), random.normal(), random.normal());
    if (gyro.full_scale_rad_s > 0) rate = rate.cwiseMin(gyro.full_scale_rad_s).cwiseMax(-gyro.full_scale_rad_s);
    first += (1 - pole) * (rate - first);
    second += (1 - pole) * (first - second);
    sum += second;
    if (++held < n) continue;
    Vec3 out = sum / n;
    sum.setZero();
    held = 0;
    if (t < 0) continue;
    if (gyro.resolution_rad_s > 0) out = (out / gyro.resolution_rad_s).array().round() * gyro.resolution_rad_s;
    imu.stamps.push_back(stamp_of(rig, t + latency));
    imu.gyro_rad_s.push_back(out);
    const double radial = length_m * bob.rate * bob.rate + gravity_m_s2 * std::cos(bob.angle);
    const double tangential = length_m * bob.acceleration + gravity_m_s2 * std::sin(bob.angle);
    imu.accel_m_s2.push_back(-radial * down + tangential * along);
  }
  return imu;
}

Estimate truth_of(const PendulumRig& rig, const GyroModel& gyro) {
  Estimate truth;
  truth.method = "truth";
  truth.sensor = rig.camera.name;
  truth.reference = gyro.name;
  truth.verdict = Verdict::trusted;
  truth.offset = from_seconds(output_delay_s(gyro, rig.pendulum.natural_rad_s));
  truth.sigma_s = 0;
  truth.drift = 0;
  truth.epoch = stamp_of(rig, 0.5 * rig.duration_s);
  truth.frame_instant = "middle";
  truth.frame_row = "first";
  truth.line_delay_s = rig.camera.line_delay_s;
  return truth;
}

}  // namespace

double wobble_angle(const BobWobble& wobble, double t) {
  return wobble_at(wobble, t).angle;
}

double temperature_delay_s(double celsius) {
  const auto curve = [](double c) {
    const double below = std::max(0.0, 40 - c) / 16, above = std::max(0.0, c - 40) / 6;
    return -0.13e-3 * below * below - 0.02e-3 * above * above;
  };
  return curve(celsius) - curve(46);
}

double output_delay_s(const GyroModel& gyro, double angular_frequency_rad_s) {
  const double w = angular_frequency_rad_s, interval = 1 / gyro.sample_rate_hz;
  if (!(w > 0)) throw std::invalid_argument("output_delay_s: the angular frequency must be positive");
  const double pole = pole_of(gyro);
  const std::complex<double> section = (1 - pole) / (1.0 - pole * std::polar(1.0, -w * interval));
  const double filter = -2 * std::arg(section) / w;
  return filter + 0.5 * (decimation(gyro) - 1) * interval + stamp_latency_s(gyro);
}

const std::vector<std::string>& pendulum_rig_names() {
  static const std::vector<std::string> names{"ordinary", "viscous", "bearing", "drag", "small", "tilted", "paper"};
  return names;
}

PendulumRig pendulum_rig(const std::string& name) {
  PendulumRig rig;
  rig.name = name;
  if (name == "ordinary") return rig;
  if (name == "viscous") {
    rig.pendulum = {.viscous_per_s = 0.008};
  } else if (name == "bearing") {
    rig.pendulum = {.coulomb_rad_s2 = 0.011};
  } else if (name == "drag") {
    rig.pendulum = {.viscous_per_s = 0.001, .coulomb_rad_s2 = 0.001, .quadratic_per_rad = 0.02};
  } else if (name == "small") {
    rig.pendulum = {.viscous_per_s = 0.012, .coulomb_rad_s2 = 0.002};
    rig.start_angle_rad = 6 * pi / 180;
  } else if (name == "tilted") {
    rig.imus.front().axis = Vec3(0.5, -0.7, 0.4).normalized();
    rig.imus.front().scale = 1.02;
    rig.camera.rest_reading_rad = 0.01;
  } else if (name == "paper") {
    // Friction and transport as the fall of Tables 1–3 of [Fu2021] suggests: docs/methods/pendulum.md.
    rig.pendulum = {.viscous_per_s = 0.003, .coulomb_rad_s2 = 0.0038};
    rig.start_angle_rad = 17 * pi / 180;
    rig.duration_s = 280;
    rig.imus[0].transport_s = 0.60e-3;
  } else {
    throw std::invalid_argument("pendulum_rig: there is no rig \"" + name + "\"");
  }
  return rig;
}

PendulumRecording simulate_pendulum(const PendulumRig& rig, std::uint64_t seed) {
  const PendulumMotion motion(rig.pendulum, rig.start_angle_rad, 0, rig.duration_s);
  PendulumRecording out;
  out.dial = dial_readings(rig, motion, seed);
  for (const GyroModel& gyro : rig.imus) {
    out.imus.push_back(gyro_readings(rig, gyro, motion, seed));
    out.truth.push_back(truth_of(rig, gyro));
  }
  return out;
}

}  // namespace takt
