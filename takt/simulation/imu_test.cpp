// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/imu.h"

#include <gtest/gtest.h>

#include <cmath>

#include "takt/simulation/motion.h"

namespace takt {
namespace {

SimulatedImu ideal() {
  SimulatedImu imu;
  imu.noise = {};
  imu.gyro_bias_rad_s = imu.accel_bias_m_s2 = 0;
  return imu;
}

double true_time(Stamp stamp, const SimulatedClocks& clocks) {
  return seconds_since(clocks.reference_start, as<ReferenceClock>(stamp));
}

TEST(Imu, AnIdealOneReadsTheTruthAtItsStamps) {
  const auto truth = make_trajectory(find_motion("handheld"), 1);
  const SimulatedClocks clocks;
  const ImuStream imu = simulate_imu(*truth, ideal(), clocks, 5, 1);
  ASSERT_EQ(imu.size(), 1001u);
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const double t = true_time(imu.stamps[i], clocks);
    EXPECT_LT((imu.gyro_rad_s[i] - truth->omega_body(t)).norm(), 1e-7);
    EXPECT_LT((imu.accel_m_s2[i] - truth->specific_force_body(t)).norm(), 1e-6);
  }
}

/// The delay that makes the truth fit the gyro best: Newton's method on Σ|gyro(t) − ω(t − d)|².
double measured_delay(const Trajectory& truth, const ImuStream& imu, const SimulatedClocks& clocks) {
  double delay = 0;
  for (int round = 0; round < 6; ++round) {
    double gradient = 0, curvature = 0;
    for (std::size_t i = 0; i < imu.size(); ++i) {
      const double t = true_time(imu.stamps[i], clocks) - delay, h = 1e-4;
      const Vec3 slope = (truth.omega_body(t + h) - truth.omega_body(t - h)) / (2 * h);
      gradient += slope.dot(truth.omega_body(t) - imu.gyro_rad_s[i]);
      curvature += slope.squaredNorm();
    }
    delay += gradient / curvature;
  }
  return delay;
}

TEST(Imu, ItsDelayIsWhatTheDataShow) {
  // Slow motion (≤ 1 Hz), where every low-pass delays by its delay at 0 Hz: at 1 Hz a 40 Hz low-pass of first order is
  // off that by (1/40)²/3, 1 µs of 4 ms; the others by less.
  const auto truth = make_trajectory(find_motion("rig"), 3);
  const SimulatedClocks clocks;
  for (const LowPassKind kind :
       {LowPassKind::none, LowPassKind::first_order, LowPassKind::second_order, LowPassKind::fir}) {
    SimulatedImu imu = ideal();
    imu.low_pass = kind;
    imu.bandwidth_hz = 40;
    imu.stamp_delay_s = 0.0013;
    const double found = measured_delay(*truth, simulate_imu(*truth, imu, clocks, 20, 1), clocks);
    EXPECT_NEAR(found, imu.delay_s(), 2e-6) << static_cast<int>(kind);
    EXPECT_GT(imu.delay_s(), kind == LowPassKind::none ? 0.0012 : 0.003);
  }
}

TEST(Imu, ItsLowPassHasTheStatedBandwidth) {
  for (const LowPassKind kind : {LowPassKind::first_order, LowPassKind::second_order, LowPassKind::fir}) {
    const double rate = 8000, f = 50;
    LowPass filter(kind, f, rate);
    double peak = 0;
    for (int n = 0; n < 16000; ++n) {
      const double y = filter.step(Vec3(std::sin(2 * M_PI * f * n / rate), 0, 0)).x();
      if (n > 8000) peak = std::max(peak, std::abs(y));
    }
    EXPECT_NEAR(peak, std::sqrt(0.5), 0.02) << static_cast<int>(kind);
  }
}

TEST(Imu, NoiseHasItsDensityAndBiasItsWalk) {
  const auto truth = make_trajectory(find_motion("still"), 1);
  SimulatedImu imu = ideal();
  imu.noise.gyro_density = 2e-4;
  imu.noise.gyro_random_walk = 0;
  const ImuStream white = simulate_imu(*truth, imu, {}, 100, 5);
  double sum = 0;
  for (const Vec3& w : white.gyro_rad_s) sum += w.squaredNorm();
  // 60 000 values: the relative σ of their standard deviation is 1/√120 000 = 0.3 %; 4σ.
  EXPECT_NEAR(std::sqrt(sum / (3.0 * static_cast<double>(white.size()))) / std::sqrt(imu.rate_hz), 2e-4, 0.012 * 2e-4);

  imu.noise = {.gyro_density = 0, .gyro_random_walk = 1e-3};
  double end = 0;
  const int runs = 100;
  for (std::uint64_t seed = 0; seed < runs; ++seed)
    end += simulate_imu(*truth, imu, {}, 4, seed).gyro_rad_s.back().squaredNorm();
  // After 4 s each axis has σ = walk·√4; 300 values: relative σ of the variance √(2/300) = 8 %; 4σ.
  EXPECT_NEAR(end / (3 * runs), 4e-6, 0.33 * 4e-6);
}

TEST(Imu, StampsKeepTheirOrderUnderHeavyJitter) {
  SimulatedImu imu;
  imu.jitter_s = 0.01;
  const ImuStream out = simulate_imu(*make_trajectory(find_motion("weak"), 1), imu, {}, 10, 2);
  for (std::size_t i = 1; i < out.size(); ++i) EXPECT_LT(out.stamps[i - 1], out.stamps[i]);
}

TEST(Imu, DropsTheAskedFraction) {
  SimulatedImu imu;
  imu.drop_fraction = 0.1;
  const ImuStream out = simulate_imu(*make_trajectory(find_motion("still"), 1), imu, {}, 50, 3);
  EXPECT_NEAR(static_cast<double>(out.size()), 9000, 4 * std::sqrt(10000 * 0.1 * 0.9));
}

TEST(Imu, QuantisesAndSaturates) {
  SimulatedImu imu;
  imu.gyro_step_rad_s = 0.01;
  imu.gyro_range_rad_s = 1;
  const ImuStream out = simulate_imu(*make_trajectory(find_motion("fast"), 1), imu, {}, 5, 1);
  double largest = 0;
  for (const Vec3& w : out.gyro_rad_s)
    for (const double x : w) {
      EXPECT_NEAR(x / 0.01, std::round(x / 0.01), 1e-9);
      largest = std::max(largest, std::abs(x));
    }
  EXPECT_EQ(largest, 1);
}

TEST(Imu, MoreDropsLeaveTheOtherSamplesAsTheyWere) {
  SimulatedImu imu;
  const auto truth = make_trajectory(find_motion("weak"), 1);
  const ImuStream all = simulate_imu(*truth, imu, {}, 2, 7);
  imu.drop_fraction = 0.5;
  const ImuStream some = simulate_imu(*truth, imu, {}, 2, 7);
  std::size_t j = 0;
  for (std::size_t i = 0; i < all.size() && j < some.size(); ++i) {
    if (all.stamps[i] != some.stamps[j]) continue;
    EXPECT_EQ(all.gyro_rad_s[i], some.gyro_rad_s[j++]);
  }
  EXPECT_EQ(j, some.size());
}

TEST(Imu, RefusesNonsense) {
  SimulatedImu imu;
  imu.rate_hz = 0;
  EXPECT_THROW(simulate_imu(*make_trajectory(find_motion("still"), 1), imu, {}, 1, 1), std::invalid_argument);
  EXPECT_THROW(LowPass(LowPassKind::fir, 600, 1000), std::invalid_argument);
}

}  // namespace
}  // namespace takt
