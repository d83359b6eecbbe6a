// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/tdicp.h"
#include "takt/test_paths.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <string>

namespace takt {
namespace {

constexpr Stamp epoch = from_ns(1'700'000'000'000'000'000);
const Mat3 R_reference_sensor = exp_so3({0.3, -1.9, 0.8}).toRotationMatrix();

/// A handheld motion: three axes, a sum of sines between 0.2 and 3 Hz.
Vec3 true_rate(double t) {
  Vec3 w = Vec3::Zero();
  for (int i = 0; i < 6; ++i) {
    const double f = 0.2 + 0.55 * i;
    w += 0.5 * Vec3(std::sin(2 * std::numbers::pi * f * t + i), std::sin(6.1 * f * t + 2.3 * i),
                    std::cos(5.7 * f * t - i * i));
  }
  return w;
}

struct Case {
  double duration_s = 30;
  double offset_s = 0.0371;
  Vec3 bias = Vec3::Zero();
  double gyro_noise = 0;    ///< rad/s a sample
  double sensor_noise = 0;  ///< rad an increment
  double frame_noise = 0;   ///< rad an orientation: what one increment gains the next one loses
  double gyro_rate_hz = 400;
  unsigned seed = 1;
};

GyroCurve gyro(const Case& s) {
  std::mt19937 random(s.seed);
  std::normal_distribution<double> normal;
  std::vector<double> t;
  std::vector<Vec3> w;
  for (int i = 0; i < s.duration_s * s.gyro_rate_hz; ++i) {
    t.push_back(i / s.gyro_rate_hz);
    w.push_back(true_rate(t.back()) + s.bias + s.gyro_noise * Vec3(normal(random), normal(random), normal(random)));
  }
  return GyroCurve(std::move(t), std::move(w));
}

/// 30 Hz, stamped by a sensor whose clock lags: reference = sensor + offset.
RotationSignal camera(const Case& s) {
  static const GyroCurve truth = gyro({.duration_s = 130, .gyro_rate_hz = 1000});
  std::mt19937 random(s.seed + 1000);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  RotationSignal signal;
  const Quat R(R_reference_sensor);
  Vec3 before = s.frame_noise * draw();
  for (int i = 0; i + 1 < (s.duration_s - 0.5) * 30; ++i) {
    const Duration from = from_seconds(0.2 + i / 30.0), to = from_seconds(0.2 + (i + 1) / 30.0);
    const Vec3 after = s.frame_noise * draw();
    const Quat turn = R.conjugate() * truth.between(to_seconds(from), to_seconds(to)) * R;
    RotationIncrement step;
    step.from = epoch + from - from_seconds(s.offset_s);
    step.to = epoch + to - from_seconds(s.offset_s);
    step.rotation = log_so3(exp_so3(-before) * turn * exp_so3(s.sensor_noise * draw()) * exp_so3(after));
    signal.increments.push_back(step);
    before = after;
  }
  return signal;
}

Mat3 near(const Mat3& R) {
  return R * exp_so3({0.05, -0.03, 0.04}).toRotationMatrix();
}

TEST(Tdicp, FindsTheOffsetOfCleanCurves) {
  for (double first_guess : {-0.1, 0.0, 0.15}) {
    const Case s;
    const TdicpResult r = tdicp(camera(s), epoch, gyro(s), first_guess, near(R_reference_sensor));
    ASSERT_TRUE(r.converged) << first_guess;
    EXPECT_NEAR(r.offset_s, s.offset_s, 10e-6) << first_guess;
    EXPECT_LT(log_so3(Quat(Mat3(R_reference_sensor.transpose() * r.R_reference_sensor))).norm(), 1e-5);
    EXPECT_LT(r.rms_rad, 1e-5);
  }
}

TEST(Tdicp, ShiftingTheSensorMovesTheOffsetBack) {
  const Case s;
  RotationSignal shifted = camera(s);
  for (RotationIncrement& step : shifted.increments) {
    step.from += std::chrono::milliseconds(40);
    step.to += std::chrono::milliseconds(40);
  }
  const GyroCurve curve = gyro(s);
  const double before = tdicp(camera(s), epoch, curve, 0, R_reference_sensor).offset_s;
  const double after = tdicp(shifted, epoch, curve, 0, R_reference_sensor).offset_s;
  EXPECT_NEAR(after, before - 0.04, 1e-7);
}

TEST(Tdicp, AConstantBiasIsFoundAndTolerated) {
  const Case s{.bias = {0.03, -0.02, 0.05}};
  const TdicpResult r = tdicp(camera(s), epoch, gyro(s), 0, near(R_reference_sensor));
  ASSERT_TRUE(r.converged);
  EXPECT_NEAR(r.offset_s, s.offset_s, 10e-6);
  EXPECT_LT((r.bias_rad_s - s.bias).norm(), 1e-4);
}

/// Mean square of error/σ over runs with fresh noise, and how many runs were more than 4σ off.
double normalised_error(Case s, int runs, int& far_off) {
  double sum = 0;
  far_off = 0;
  for (int run = 0; run < runs; ++run) {
    s.seed = 100 + run;
    const TdicpResult r = tdicp(camera(s), epoch, gyro(s), 0.03, near(R_reference_sensor));
    EXPECT_TRUE(r.converged);
    const double z = (r.offset_s - s.offset_s) / r.sigma_s;
    sum += z * z;
    far_off += std::abs(z) > 4;
  }
  return sum / runs;
}

// σ is measured from the scatter of 15 windows less 7 unknowns, so error/σ has the tails of a t distribution with few
// degrees of freedom: its mean square is ν/(ν − 2) ≈ 1.2 to 1.5 at best. Over 60 runs that mean itself scatters by 25
// %.
TEST(Tdicp, KnowsItsErrorForIndependentIncrements) {
  int far_off;
  const double z2 = normalised_error({.gyro_noise = 0.002, .sensor_noise = 1e-3}, 60, far_off);
  EXPECT_GT(z2, 0.5);
  EXPECT_LT(z2, 2.2);
  EXPECT_LE(far_off, 2);
}
TEST(Tdicp, KnowsItsErrorForIndependentOrientations) {
  int far_off;
  const double z2 = normalised_error({.gyro_noise = 0.002, .frame_noise = 2e-3}, 60, far_off);
  EXPECT_GT(z2, 0.5);
  EXPECT_LT(z2, 2.2);
  EXPECT_LE(far_off, 2);
}

TEST(Tdicp, GapsAndBadIncrementsDoNotMatter) {
  const Case s{.duration_s = 60, .sensor_noise = 1e-4};
  RotationSignal signal = camera(s);
  signal.increments.erase(signal.increments.begin() + 200, signal.increments.begin() + 240);
  for (int i = 700; i < 705; ++i) signal.increments[i].information.setZero();
  for (int i = 700; i < 705; ++i) signal.increments[i].rotation = {1, 2, 3};
  signal.increments[1000].rotation += Vec3(0.3, 0, 0);  // and one that nobody flagged
  const TdicpResult r = tdicp(signal, epoch, gyro(s), 0, near(R_reference_sensor));
  ASSERT_TRUE(r.converged);
  EXPECT_NEAR(r.offset_s, s.offset_s, 4 * r.sigma_s);
  EXPECT_LT(r.sigma_s, 3e-4);
}

TEST(Tdicp, StillnessAndScarcityDoNotConverge) {
  const Case s;
  RotationSignal still = camera(s);
  for (RotationIncrement& step : still.increments) step.rotation.setZero();
  std::vector<double> times;
  for (int i = 0; i < 3000; ++i) times.push_back(i * 0.01);
  const GyroCurve resting(times, std::vector<Vec3>(times.size(), Vec3::Zero()));
  const TdicpResult r = tdicp(still, epoch, resting, 0, R_reference_sensor);
  EXPECT_FALSE(r.converged);
  EXPECT_TRUE(std::isinf(r.sigma_s));

  const GyroCurve curve = gyro(s);
  EXPECT_FALSE(tdicp(RotationSignal{}, epoch, curve, 0, R_reference_sensor).converged);
  EXPECT_FALSE(tdicp(camera(s), epoch, curve, 500, R_reference_sensor).converged);
}

/// A phone and a microcontroller, rigidly joined, on clocks ten days apart.
std::pair<std::vector<double>, std::vector<Vec3>> read_gyro(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  std::pair<std::vector<double>, std::vector<Vec3>> out;
  char comma;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    double t;
    Vec3 w;
    row >> t >> comma >> w.x() >> comma >> w.y() >> comma >> w.z();
    out.first.push_back(t);
    out.second.push_back(w);
  }
  return out;
}

TEST(Tdicp, AgreesWithThePublishedOffsetOfTwoGyros) {
  const std::string folder = TAKT_DATA_DIR "/phone_mcu_gyro";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "needs the recordings in " << folder;
  auto [mcu_t, mcu_w] = read_gyro(folder + "/mcu_gyro_data.csv");
  auto [phone_t, phone_w] = read_gyro(folder + "/smartphone_gyro_data.csv");
  const double published = 947848.6384083, mcu_start = mcu_t.front(), phone_start = phone_t.front();
  for (double& t : mcu_t) t -= mcu_start;
  for (double& t : phone_t) t -= phone_start;
  const GyroCurve mcu(mcu_t, mcu_w), phone(phone_t, phone_w);
  RotationSignal sensor;
  for (double t = 0.1; t + 0.02 < mcu.end_s(); t += 0.02) {
    RotationIncrement step;
    step.from = epoch + from_seconds(t);
    step.to = epoch + from_seconds(t + 0.02);
    if (!sensor.increments.empty()) step.from = sensor.increments.back().to;
    step.rotation = log_so3(mcu.between(seconds_since(epoch, step.from), seconds_since(epoch, step.to)));
    sensor.increments.push_back(step);
  }
  const double expected = published + mcu_start - phone_start;
  Mat3 correlation = Mat3::Zero();
  for (double t = 0.1; t < mcu.end_s(); t += 0.01)
    if (phone.covers(t + expected, t + expected)) correlation += phone.rate(t + expected) * mcu.rate(t).transpose();
  for (double guess_error : {-0.05, 0.03}) {
    const TdicpResult r = tdicp(sensor, epoch, phone, expected + guess_error, align_vectors(correlation).rotation);
    ASSERT_TRUE(r.converged);
    EXPECT_NEAR(r.offset_s, expected, 100e-6) << "sigma " << r.sigma_s << ", windows " << r.windows;
    EXPECT_NEAR(r.offset_s - expected, 947848.6383438 - published, 4 * r.sigma_s) << "another method's figure";
  }
}

}  // namespace
}  // namespace takt
