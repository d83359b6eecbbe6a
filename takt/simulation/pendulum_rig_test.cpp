// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/pendulum_rig.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace takt {
namespace {

PendulumRig noiseless(PendulumRig rig) {
  rig.camera.angle_noise_rad = 0;
  for (GyroModel& gyro : rig.imus) {
    gyro.noise_density = 0;
    gyro.bias_rad_s.setZero();
  }
  return rig;
}

TEST(PendulumRig, TheTruthIsTheDelayThatTheRatesShow) {
  for (const double filter : {2.9e-3, 3.9e-3, 5.9e-3})
    for (const double rate : {1000.0, 500.0, 250.0, 200.0}) {
      PendulumRig rig = noiseless(pendulum_rig("ordinary"));
      rig.duration_s = 20;
      rig.imus[0].filter_delay_s = filter;
      rig.imus[0].output_rate_hz = rate;
      const PendulumRecording run = simulate_pendulum(rig, 7);
      const PendulumMotion motion(rig.pendulum, rig.start_angle_rad, 0, rig.duration_s);
      const double delay = to_seconds(*run.truth[0].offset);
      // Least squares of the difference on rate and acceleration: a gain (the filter has one) and the missing delay.
      Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
      Vec2 right = Vec2::Zero();
      for (std::size_t i = 0; i < run.imus[0].size(); ++i) {
        const double t = seconds_since(from_ns(rig.epoch_ns), run.imus[0].stamps[i]) - delay;
        if (t < 0.5) continue;
        const PendulumState s = motion.at(t);
        const Vec2 row(s.rate, -s.acceleration);
        normal += row * row.transpose();
        right += row * (run.imus[0].gyro_rad_s[i].y() - s.rate);
      }
      const Vec2 found = normal.inverse() * right;
      EXPECT_NEAR(found[0], 0, 1e-3);
      // A swing that dies away as e^{−δt} is a complex frequency: that moves the delay by δ times the variance of the
      // impulse response, here up to 0.01/s · 2·(2.95 ms)² = 0.17 µs.
      EXPECT_NEAR(found[1], 0, 0.2e-6) << filter << " s, " << rate << " Hz";
    }
}

TEST(PendulumRig, TheDelayIsALineInTheOutputIntervalAsTable4) {
  GyroModel gyro;
  const auto delay = [&](double rate) {
    gyro.output_rate_hz = rate;
    return output_delay_s(gyro, 4.2226);
  };
  const double slope = (delay(200) - delay(1000)) / 4e-3;
  EXPECT_NEAR(slope, 1.42, 0.01);  // [Fu2021] table 4: 1.413, 1.424, 1.426
  EXPECT_NEAR(delay(250), delay(1000) + 3e-3 * slope, 1e-9);
}

TEST(PendulumRig, TemperatureCurveHasThePapersShape) {
  double highest = -1, at = 0, lowest = 1;
  for (double c = 23; c <= 50; c += 0.5) {
    const double d = temperature_delay_s(c);
    if (d > highest) highest = d, at = c;
    lowest = std::min(lowest, d);
  }
  EXPECT_EQ(at, 40);
  EXPECT_LT(highest - lowest, 0.15e-3);
  EXPECT_EQ(temperature_delay_s(46), 0);
}

TEST(PendulumRig, StampModesMoveTheStampAndSayWhichInstantTheyMean) {
  PendulumRig rig = noiseless(pendulum_rig("ordinary"));
  rig.duration_s = 2;
  rig.camera.exposure_s = 2e-3;
  rig.camera.stamp = ExposureInstant::middle;
  const AngleStream middle = simulate_pendulum(rig, 3).dial;
  rig.camera.stamp = ExposureInstant::start;
  const AngleStream start = simulate_pendulum(rig, 3).dial;
  ASSERT_EQ(start.size(), middle.size());
  for (std::size_t i = 0; i < start.size(); ++i) {
    EXPECT_EQ((middle.stamps[i] - start.stamps[i]).count(), 1'000'000);
    EXPECT_EQ(middle.angle_rad[i], start.angle_rad[i]);
  }
  EXPECT_EQ(start.timing.instant, ExposureInstant::start);
}

TEST(PendulumRig, SameSeedSameRecordingOtherSeedOther) {
  const PendulumRig rig = pendulum_rig("tilted");
  const auto a = simulate_pendulum(rig, 5), b = simulate_pendulum(rig, 5), c = simulate_pendulum(rig, 6);
  EXPECT_EQ(a.dial.angle_rad, b.dial.angle_rad);
  EXPECT_EQ(a.imus[0].gyro_rad_s, b.imus[0].gyro_rad_s);
  EXPECT_NE(a.dial.angle_rad, c.dial.angle_rad);
}

TEST(PendulumRig, NoiseHasTheDensityItSays) {
  // The mean over whole seconds of white noise of density d has the variance d²/second.
  PendulumRig rig = pendulum_rig("ordinary");
  rig.duration_s = 200;
  rig.imus[0].axis = Vec3::UnitX();
  const ImuStream imu = simulate_pendulum(rig, 11).imus[0];
  double sum = 0, squares = 0;
  const int seconds = 195;
  for (int s = 0; s < seconds; ++s) {
    double mean = 0;
    for (int k = 0; k < 1000; ++k) mean += imu.gyro_rad_s[static_cast<std::size_t>(s * 1000 + k)].z() / 1000;
    sum += mean;
    squares += mean * mean;
  }
  const double variance = squares / seconds - (sum / seconds) * (sum / seconds);
  const double expected = rig.imus[0].noise_density * rig.imus[0].noise_density;
  EXPECT_NEAR(variance / expected, 1, 4 * std::sqrt(2.0 / seconds));  // 4 standard errors: 1 in 16 000
}

TEST(PendulumRig, AnUnknownNameAndAnImpossibleRateAreRefused) {
  EXPECT_THROW(static_cast<void>(pendulum_rig("grandfather")), std::invalid_argument);
  PendulumRig rig = pendulum_rig("ordinary");
  rig.imus[0].output_rate_hz = 300;
  EXPECT_THROW(static_cast<void>(simulate_pendulum(rig, 1)), std::invalid_argument);
}

}  // namespace
}  // namespace takt
