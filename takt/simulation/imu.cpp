// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/imu.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "takt/simulation/random.h"

namespace takt {

namespace {

Vec3 normal3(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

Mat3 draw_matrix(const SimulatedImu& imu, Random& random) {
  Mat3 m = Mat3::Identity();
  for (int i = 0; i < 3; ++i) {
    m(i, i) += imu.scale_error * random.normal();
    for (int j = 0; j < i; ++j) m(i, j) = imu.misalignment_rad * random.normal();
  }
  return m;
}

/// One of the two triads: from the true vector to the reading.
class Triad {
 public:
  Triad(const SimulatedImu& imu, double density, double walk, double bias, double step, double range, Random random)
      : random_(random), step_(step), range_(range) {
    matrix_ = draw_matrix(imu, random_);
    bias_ = bias * normal3(random_);
    white_ = density * std::sqrt(imu.rate_hz);
    walk_ = walk / std::sqrt(imu.rate_hz);
  }

  Vec3 read(const Vec3& truth) {
    bias_ += walk_ * normal3(random_);
    Vec3 reading = matrix_ * truth + bias_ + white_ * normal3(random_);
    if (step_ > 0) reading = step_ * (reading / step_).array().round().matrix();
    if (range_ > 0) reading = reading.cwiseMin(range_).cwiseMax(-range_);
    return reading;
  }

 private:
  Random random_;
  Mat3 matrix_;
  Vec3 bias_;
  double white_ = 0, walk_ = 0, step_, range_;
};

/// What the body's motion is at the place of the IMU, along its axes.
class Mounted {
 public:
  Mounted(const Trajectory& truth, const Mat4& T_body_imu)
      : truth_(truth),
        to_imu_(T_body_imu.topLeftCorner<3, 3>().transpose()),
        lever_(T_body_imu.topRightCorner<3, 1>()),
        aside_(!T_body_imu.isIdentity(0)) {}

  [[nodiscard]] Vec3 omega(double t) const {
    const Vec3 w = truth_.omega_body(t);
    return aside_ ? Vec3(to_imu_ * w) : w;
  }
  [[nodiscard]] Vec3 force(double t) const {
    const Vec3 f = truth_.specific_force_body(t);
    if (!aside_) return f;
    constexpr double h = 1e-4;
    const Vec3 w = truth_.omega_body(t), turning = (truth_.omega_body(t + h) - truth_.omega_body(t - h)) / (2 * h);
    return to_imu_ * (f + turning.cross(lever_) + w.cross(w.cross(lever_)));
  }

 private:
  const Trajectory& truth_;
  Mat3 to_imu_;
  Vec3 lever_;
  bool aside_;
};

}  // namespace

Mat3 gyro_matrix(const SimulatedImu& imu, std::uint64_t seed) {
  Random random(seed, "gyro");
  return draw_matrix(imu, random);
}

Mat3 accel_matrix(const SimulatedImu& imu, std::uint64_t seed) {
  Random random(seed, "accel");
  return draw_matrix(imu, random);
}

double SimulatedImu::internal_rate_hz() const {
  if (low_pass == LowPassKind::none) return rate_hz;
  const double wanted = std::max(1000.0, 20 * bandwidth_hz);
  return rate_hz * std::ceil(wanted / rate_hz);
}

double SimulatedImu::delay_s() const {
  return LowPass(low_pass, bandwidth_hz, internal_rate_hz()).delay_s() + stamp_delay_s;
}

ImuStream simulate_imu(const Trajectory& truth, const SimulatedImu& imu, const SimulatedClocks& clocks,
                       double duration_s, std::uint64_t seed) {
  if (!(imu.rate_hz > 0) || !(duration_s > 0))
    throw std::invalid_argument("simulate_imu: rate " + std::to_string(imu.rate_hz) + " Hz and duration " +
                                std::to_string(duration_s) + " s must be positive");
  const double internal = imu.internal_rate_hz();
  const auto decimation = static_cast<std::int64_t>(std::lround(internal / imu.rate_hz));
  LowPass gyro_filter(imu.low_pass, imu.bandwidth_hz, internal);
  LowPass accel_filter = gyro_filter;
  Triad gyro(imu, imu.noise.gyro_density, imu.noise.gyro_random_walk, imu.gyro_bias_rad_s, imu.gyro_step_rad_s,
             imu.gyro_range_rad_s, Random(seed, "gyro"));
  Triad accel(imu, imu.noise.accel_density, imu.noise.accel_random_walk, imu.accel_bias_m_s2, imu.accel_step_m_s2,
              imu.accel_range_m_s2, Random(seed, "accel"));
  Random stamps(seed, "imu stamps"), drops(seed, "imu drops");

  ImuStream out;
  out.name = "imu0";
  out.clock = "imu0";
  out.noise = imu.noise;
  out.T_body_imu = imu.T_body_imu;
  const Mounted mounted(truth, imu.T_body_imu);
  const auto run_in = static_cast<std::int64_t>(std::ceil(gyro_filter.memory_s() * internal));
  const auto last = static_cast<std::int64_t>(std::floor(duration_s * internal));
  for (std::int64_t n = -run_in; n <= last; ++n) {
    const double t = static_cast<double>(n) / internal;
    const Vec3 omega = gyro_filter.step(mounted.omega(t));
    const Vec3 force = accel_filter.step(mounted.force(t));
    if (n < 0 || n % decimation != 0) continue;
    const Vec3 gyro_reading = gyro.read(omega), accel_reading = accel.read(force);
    const double jitter = std::clamp(imu.jitter_s * stamps.normal(), -0.45 / imu.rate_hz, 0.45 / imu.rate_hz);
    if (drops.chance(imu.drop_fraction)) continue;
    out.stamps.push_back(as_stamp(clocks.at(t + imu.stamp_delay_s + jitter)));
    out.gyro_rad_s.push_back(gyro_reading);
    out.accel_m_s2.push_back(accel_reading);
  }
  return out;
}

}  // namespace takt
