// SPDX-License-Identifier: Apache-2.0
// Several cameras and IMUs in one, and IMUs that are not what their data sheets say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "takt/estimators/batch/batch.h"
#include "takt/motion/rigid.h"
#include "takt/simulation/simulated_corners.h"

namespace takt {
namespace {

constexpr double sigmas = 4;

std::string words(const Estimate& e) {
  std::string out = e.sensor + ", " + to_string(e.verdict);
  for (const std::string& why : e.reasons) out += "; " + why;
  return out;
}

Extra extra(const Estimate& e, const std::string& name) {
  const auto found = std::ranges::find(e.extras, name, &Extra::name);
  if (found == e.extras.end()) throw std::out_of_range(name);
  return *found;
}

bool says(const Estimate& e, const std::string& what) {
  return std::ranges::any_of(e.reasons, [&](const std::string& r) { return r.find(what) != std::string::npos; });
}

const Estimate& truth_of(const SimulatedBoard& run, const std::string& sensor) {
  if (run.truth.sensor == sensor) return run.truth;
  return *std::ranges::find(run.truth.estimates, sensor, &Estimate::sensor);
}

/// Offset, drift and all six numbers of the pose lie within their σ.
void expect_right(const Estimate& e, const Estimate& truth) {
  ASSERT_TRUE(e.answered()) << words(e);
  EXPECT_EQ(e.verdict, Verdict::trusted) << words(e);
  const double error =
      to_seconds(*e.offset - *truth.offset) - truth.drift.value_or(0) * to_seconds(e.epoch - truth.epoch);
  EXPECT_LT(std::abs(error), sigmas * *e.sigma_s) << words(e);
  EXPECT_LT(std::abs(*e.drift - *truth.drift), sigmas * std::max(*e.drift_sigma, 1e-9)) << words(e);
  const Rigid found = Rigid::from_matrix(*e.T_reference_sensor), is = Rigid::from_matrix(*truth.T_reference_sensor);
  const Vec3 turn = log_so3(is.rotation.conjugate() * found.rotation), shift = found.translation - is.translation;
  for (int i = 0; i < 3; ++i) {
    const std::string axis(1, "xyz"[i]);
    EXPECT_LT(std::abs(turn[i]), sigmas * *extra(e, "rotation_" + axis + "_rad").sigma) << words(e) << axis;
    EXPECT_LT(std::abs(shift[i]), sigmas * *extra(e, "translation_" + axis + "_m").sigma) << words(e) << axis;
  }
}

/// A stereo pair that is not triggered together, each with a clock of its own, and two IMUs.
const SimulatedBoard& recorded() {
  static const SimulatedBoard run = [] {
    TargetFilmOptions o;
    o.seed = 3;
    o.duration_s = 12;
    o.cameras = 2;
    o.camera_offset_step_s = 0.0123;
    o.imus = 2;
    o.imu_offset_step_s = -0.0041;
    return simulate_board(o);
  }();
  return run;
}
const std::vector<Estimate>& calibrated() {
  static const std::vector<Estimate> all = calibrate_rig(recorded().cameras, recorded().imus);
  return all;
}

TEST(Rig, EverySensorHasItsOwnOffsetAndPlace) {
  ASSERT_EQ(calibrated().size(), 3u);
  const char* const names[] = {"cam0", "cam1", "imu1"};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(calibrated()[i].sensor, names[i]);
    EXPECT_EQ(calibrated()[i].reference, "imu0");
    expect_right(calibrated()[i], truth_of(recorded(), names[i]));
    EXPECT_LT(*calibrated()[i].sigma_s, 1e-5);
  }
}

TEST(Rig, TheChainOfCamerasIsKnownBetterThanEitherOfThem) {
  const Estimate &a = calibrated()[0], &b = calibrated()[1];
  const Rigid T = Rigid::from_matrix(*b.T_reference_sensor).inverse() * Rigid::from_matrix(*a.T_reference_sensor);
  const Rigid is = Rigid::from_matrix(*truth_of(recorded(), "cam1").T_reference_sensor).inverse() *
                   Rigid::from_matrix(*truth_of(recorded(), "cam0").T_reference_sensor);
  const Vec3 turn = log_so3(T.rotation * is.rotation.conjugate()), shift = T.translation - is.translation;
  for (int i = 0; i < 3; ++i) {
    const std::string axis(1, "xyz"[i]);
    const Extra place = extra(b, "chain_cam0_translation_" + axis + "_m"),
                rotation = extra(b, "chain_cam0_rotation_" + axis + "_rad");
    EXPECT_NEAR(place.value, T.translation[i], 1e-12);
    EXPECT_LT(std::abs(shift[i]), sigmas * *place.sigma) << axis;
    EXPECT_LT(std::abs(turn[i]), sigmas * *rotation.sigma) << axis;
    EXPECT_LT(*place.sigma, *extra(b, "translation_" + axis + "_m").sigma);
  }
  const double apart = to_seconds(*b.offset - *a.offset) -
                       to_seconds(*truth_of(recorded(), "cam1").offset - *truth_of(recorded(), "cam0").offset);
  EXPECT_LT(std::abs(apart), sigmas * extra(b, "offset_sigma_against_cam0_s").value);
}

TEST(Rig, MoreSensorsKnowMore) {
  const Estimate alone = calibrate_batch(recorded().cameras[0], recorded().imus[0]);
  EXPECT_LT(*calibrated()[0].sigma_s, 0.95 * *alone.sigma_s);
}

TEST(Rig, TheDiscreteModelTakesThemPairByPair) {
  const std::vector<Estimate> all = calibrate_rig(recorded().cameras, recorded().imus, {.model = "discrete"});
  ASSERT_EQ(all.size(), 3u);
  for (const Estimate& e : all) {
    ASSERT_TRUE(e.answered()) << words(e);
    EXPECT_EQ(e.method, "discrete");
    EXPECT_LT(std::abs(to_seconds(*e.offset - *truth_of(recorded(), e.sensor).offset)), sigmas * *e.sigma_s);
  }
}

TEST(Rig, ASensorThatCannotBeUsedLeavesTheOthersAlone) {
  std::vector<CornerStream> cameras = recorded().cameras;
  for (auto& corners : cameras[0].corners) corners.clear();
  std::vector<ImuStream> imus = recorded().imus;
  imus[1].accel_m_s2.clear();
  const std::vector<Estimate> all = calibrate_rig(cameras, imus);
  EXPECT_EQ(all[0].verdict, Verdict::refused);
  expect_right(all[1], truth_of(recorded(), "cam1"));
  EXPECT_EQ(all[2].verdict, Verdict::refused);
  EXPECT_TRUE(says(all[2], "no accelerometer")) << words(all[2]);
}

TEST(Rig, AnEmptyRigIsTheCallersFault) {
  EXPECT_THROW((void)calibrate_rig({}, recorded().imus), std::invalid_argument);
  EXPECT_THROW((void)calibrate_rig(recorded().cameras, {}), std::invalid_argument);
  EXPECT_THROW((void)calibrate_rig(recorded().cameras, recorded().imus, {.imu_model = "perfect"}),
               std::invalid_argument);
}

// --- IMUs that are not what their data sheets say ---

TEST(RigImu, ScalesAndAxesAreFoundWithoutBeingAskedFor) {
  TargetFilmOptions o;
  o.seed = 5;
  o.duration_s = 12;
  o.imu.scale_error = 0.01;
  o.imu.misalignment_rad = 0.01;
  const SimulatedBoard run = simulate_board(o);
  const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
  expect_right(e, run.truth);
  EXPECT_TRUE(says(e, "scales and axes")) << words(e);
  const Mat3 gyro = gyro_matrix(o.imu, o.seed), accel = accel_matrix(o.imu, o.seed);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      const std::string at = std::to_string(row) + std::to_string(column);
      const Extra g = extra(e, "gyro_matrix_" + at);
      EXPECT_LT(std::abs(g.value - gyro(row, column)), sigmas * *g.sigma) << at;
      if (column > row) continue;
      const Extra a = extra(e, "accel_matrix_" + at);
      // Gravity's length is the measure; 9.80665 in truth, 9.806 ± 0.02 to the estimator.
      EXPECT_LT(std::abs(a.value - accel(row, column)), sigmas * *a.sigma) << at;
    }
  // Told that it is calibrated, the answer is not trusted.
  const Estimate told = calibrate_batch(run.cameras[0], run.imus[0], {.knots_s = 0.02, .imu_model = "calibrated"});
  EXPECT_NE(told.verdict, Verdict::trusted) << words(told);
  EXPECT_TRUE(says(told, "scale-misalignment")) << words(told);
}

TEST(RigImu, ALowPassIsFoundAndDoesNotMoveTheCamera) {
  for (const LowPassKind kind : {LowPassKind::second_order, LowPassKind::first_order}) {
    TargetFilmOptions o;
    o.seed = 6;
    o.duration_s = 12;
    o.imu.low_pass = kind;
    o.imu.bandwidth_hz = 40;
    const SimulatedBoard run = simulate_board(o);
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
    expect_right(e, run.truth);
    // A second-order filter is as good as a delay up to 3 Hz, a first-order one is not.
    if (kind == LowPassKind::first_order) {
      EXPECT_TRUE(says(e, "filters its readings")) << words(e);
    }
  }
}

TEST(RigImu, AnAccelerometerThatIsLaterThanTheGyroIsFound) {
  TargetFilmOptions o;
  o.seed = 7;
  o.duration_s = 12;
  o.imu.low_pass = LowPassKind::second_order;
  o.imu.bandwidth_hz = 40;
  const SimulatedBoard filtered = simulate_board(o);
  o.imu.low_pass = LowPassKind::none;
  const SimulatedBoard plain = simulate_board(o);
  ImuStream mixed = plain.imus[0];
  mixed.accel_m_s2 = filtered.imus[0].accel_m_s2;
  const Estimate e = calibrate_batch(plain.cameras[0], mixed);
  expect_right(e, plain.truth);
  o.imu.low_pass = LowPassKind::second_order;
  EXPECT_NEAR(extra(e, "accel_lag_s").value, o.imu.delay_s(), 1e-4) << words(e);
}

TEST(RigImu, AnIdealOneIsLeftAsItIs) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    TargetFilmOptions o;
    o.seed = seed;
    o.duration_s = 10;
    const SimulatedBoard run = simulate_board(o);
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
    EXPECT_FALSE(says(e, "scales and axes")) << words(e);
    EXPECT_FALSE(says(e, "filters")) << words(e);
  }
}

}  // namespace
}  // namespace takt
