// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>

#include "takt/estimators/batch/board_pose.h"
#include "takt/estimators/batch/intrinsics.h"
#include "takt/motion/rigid.h"
#include "takt/simulation/simulated_corners.h"

namespace takt {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double sigmas = 4;

TargetFilmOptions usual(std::uint64_t seed = 1, double duration_s = 12) {
  TargetFilmOptions o;
  o.seed = seed;
  o.duration_s = duration_s;
  return o;
}

std::string words(const Estimate& e) {
  std::string out = e.method + ", " + to_string(e.verdict);
  for (const std::string& why : e.reasons) out += "; " + why;
  return out;
}

double offset_error_s(const Estimate& e, const Estimate& truth) {
  return to_seconds(*e.offset - *truth.offset) - truth.drift.value_or(0) * to_seconds(e.epoch - truth.epoch);
}

std::optional<double> extra(const Estimate& e, const std::string& name) {
  for (const Extra& x : e.extras)
    if (x.name == name) return x.value;
  return std::nullopt;
}

bool says(const Estimate& e, const std::string& what) {
  return std::ranges::any_of(e.reasons, [&](const std::string& r) { return r.find(what) != std::string::npos; });
}

/// Rotation and translation between what was found and what is true.
std::pair<double, double> pose_error(const Estimate& e, const Estimate& truth) {
  const Rigid found = Rigid::from_matrix(*e.T_reference_sensor), is = Rigid::from_matrix(*truth.T_reference_sensor);
  return {log_so3(is.rotation.conjugate() * found.rotation).norm(), (found.translation - is.translation).norm()};
}

void expect_right(const Estimate& e, const Estimate& truth, Verdict verdict = Verdict::trusted) {
  ASSERT_TRUE(e.answered()) << words(e);
  EXPECT_EQ(e.verdict, verdict) << words(e);
  EXPECT_LT(std::abs(offset_error_s(e, truth)), sigmas * *e.sigma_s) << words(e);
  EXPECT_LT(*e.sigma_s, 2e-4);
}

void expect_refused(const Estimate& e) {
  EXPECT_EQ(e.verdict, Verdict::refused) << words(e);
  EXPECT_FALSE(e.answered());
  ASSERT_FALSE(e.reasons.empty());
}

void stamp_shift(std::vector<Stamp>& stamps, Duration by) {
  for (Stamp& t : stamps) t += by;
}

/// One recording for the laws, and what it gives.
const SimulatedBoard& recorded() {
  static const SimulatedBoard run = simulate_board(usual());
  return run;
}
const Estimate& plain() {
  static const Estimate e = calibrate_batch(recorded().cameras[0], recorded().imus[0]);
  return e;
}

TEST(Batch, FindsOffsetRotationAndPlace) {
  const Estimate& truth = recorded().truth;
  expect_right(plain(), truth);
  EXPECT_LT(*plain().sigma_s, 1e-5);
  const auto [rotation, place] = pose_error(plain(), truth);
  EXPECT_LT(rotation, 0.01 * degree);
  EXPECT_LT(place, 5e-4);
  for (const char* name : {"gravity_board_x_m_s2", "gravity_board_y_m_s2", "gravity_board_z_m_s2"})
    EXPECT_NEAR(*extra(plain(), name), *extra(truth, name), 0.02) << name;
  EXPECT_NEAR(*extra(plain(), "corner_noise_px"), 0.07, 0.002);
  EXPECT_NEAR(*extra(plain(), "gyro_noise_rad_s_sqrthz"), 1.7e-4, 1e-5);
  EXPECT_NEAR(*extra(plain(), "accel_noise_m_s2_sqrthz"), 2e-3, 2e-4);
}

TEST(Batch, BothModelsAgree) {
  ASSERT_EQ(plain().estimates.size(), 2u);
  const Estimate &discrete = plain().estimates[0], &spline = plain().estimates[1];
  EXPECT_EQ(discrete.method, "discrete");
  EXPECT_EQ(spline.method, "spline");
  ASSERT_TRUE(discrete.answered() && spline.answered());
  EXPECT_LT(std::abs(to_seconds(*discrete.offset - *spline.offset)), *spline.sigma_s);
  EXPECT_NEAR(*discrete.sigma_s / *spline.sigma_s, 1, 0.15);
  const Estimate alone = calibrate_batch(recorded().cameras[0], recorded().imus[0], {.model = "discrete"});
  EXPECT_EQ(alone.method, "discrete");
  EXPECT_EQ(alone.offset, discrete.offset);
}

TEST(Batch, EveryNumberHasItsSigma) {
  for (const char* name : {"rotation_x_rad", "translation_z_m", "gravity_board_y_m_s2", "gyro_bias_x_rad_s",
                           "accel_bias_z_m_s2", "board_scale"}) {
    const auto found = std::ranges::find(plain().extras, name, &Extra::name);
    ASSERT_NE(found, plain().extras.end()) << name;
    EXPECT_GT(found->sigma.value_or(0), 0) << name;
  }
  EXPECT_TRUE(plain().drift_sigma.has_value());
}

TEST(Batch, ThePanelsHoldWhatTheySay) {
  std::vector<std::string> names;
  for (const Panel& p : plain().evidence.panels) {
    names.push_back(p.name);
    EXPECT_FALSE(p.x.values.empty()) << p.name;
    for (const Series& s : p.y) EXPECT_EQ(s.values.size(), p.x.values.size()) << p.name;
  }
  for (const char* name : {"coverage", "windows", "reprojection", "gyro_residuals", "accel_residuals", "gyro_bias"})
    EXPECT_NE(std::ranges::find(names, name), names.end()) << name;
}

// --- Laws ---

TEST(BatchLaws, ShiftingTheCameraMovesTheOffsetBack) {
  CornerStream shifted = recorded().cameras[0];
  const Duration by = std::chrono::hours(24 * 11) + Duration(1);
  stamp_shift(shifted.stamps, by);
  const Estimate e = calibrate_batch(shifted, recorded().imus[0]);
  ASSERT_TRUE(e.answered());
  EXPECT_LE(std::abs((*e.offset + by - *plain().offset).count()), 1);
  EXPECT_EQ(e.sigma_s, plain().sigma_s);
}

TEST(BatchLaws, HalfASecondEitherWayIsAllTheSame) {
  for (const double offset : {-0.5, 0.5}) {
    TargetFilmOptions o = usual();
    o.offset_s = offset;
    const SimulatedBoard run = simulate_board(o);
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
    expect_right(e, run.truth);
    EXPECT_LT(std::abs(offset_error_s(e, run.truth) - offset_error_s(plain(), recorded().truth)), 0.2 * *e.sigma_s);
  }
}

TEST(BatchLaws, HowTheImuIsMountedIsAllTheSame) {
  const Quat turn(Eigen::AngleAxisd(2.1, Vec3(0.3, -0.8, 0.5).normalized()));
  ImuStream turned = recorded().imus[0];
  for (Vec3& w : turned.gyro_rad_s) w = turn * w;
  for (Vec3& a : turned.accel_m_s2) a = turn * a;
  const Estimate e = calibrate_batch(recorded().cameras[0], turned);
  ASSERT_TRUE(e.answered()) << words(e);
  EXPECT_LT(std::abs(to_seconds(*e.offset - *plain().offset)), 0.02 * *e.sigma_s);
  const Mat3 R = e.T_reference_sensor->topLeftCorner<3, 3>(),
             before = plain().T_reference_sensor->topLeftCorner<3, 3>();
  EXPECT_LT(log_so3(Quat(R.transpose() * turn.toRotationMatrix() * before)).norm(), 1e-5);
}

TEST(BatchLaws, HowTheBoardStandsIsAllTheSame) {
  CornerStream moved = recorded().cameras[0];
  const Quat turn(Eigen::AngleAxisd(1.2, Vec3::UnitZ()));
  for (Vec3& p : moved.board) p = turn * p + Vec3(3, -2, 0);
  const Estimate e = calibrate_batch(moved, recorded().imus[0]);
  ASSERT_TRUE(e.answered()) << words(e);
  EXPECT_LT(std::abs(to_seconds(*e.offset - *plain().offset)), 0.02 * *e.sigma_s);
}

TEST(BatchLaws, ThreadsChangeNothing) {
  for (const int threads : {1, 3}) {
    const Estimate e = calibrate_batch(recorded().cameras[0], recorded().imus[0], {.threads = threads});
    EXPECT_EQ(to_json(e), to_json(plain()));
  }
}

// --- What may be wrong with a recording ---

TEST(BatchFaults, ADriftIsPartOfTheAnswer) {
  TargetFilmOptions o = usual();
  o.drift = 200e-6;
  const SimulatedBoard run = simulate_board(o);
  const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
  expect_right(e, run.truth);
  EXPECT_LT(std::abs(*e.drift - o.drift), sigmas * *e.drift_sigma);
  EXPECT_LT(std::abs(*e.drift - o.drift) * o.duration_s / 2, 5e-5);
  EXPECT_TRUE(says(e, "drift"));
}

TEST(BatchFaults, ARollingShutterIsFoundThoughNobodySaysSo) {
  TargetFilmOptions o = usual();
  o.camera.readout_s = 30e-6 * o.camera.height;
  SimulatedBoard run = simulate_board(o);
  for (const Shutter said : {Shutter::unknown, Shutter::global}) {
    run.cameras[0].timing.shutter = said;
    run.cameras[0].timing.readout_s = 0;
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
    expect_right(e, run.truth);
    EXPECT_NEAR(*e.line_delay_s, 30e-6, 1e-7);
    EXPECT_LT(std::abs(*e.line_delay_s - 30e-6), sigmas * *e.line_delay_sigma_s);
    EXPECT_LT(std::abs(offset_error_s(e, run.truth)), 2e-5);
    EXPECT_LT(pose_error(e, run.truth).first, 0.01 * degree);
    EXPECT_TRUE(says(e, "rolling shutter"));
  }
}

TEST(BatchFaults, JitteringStampsAreMeasured) {
  TargetFilmOptions o = usual();
  o.camera.jitter_s = 2e-3;
  const SimulatedBoard run = simulate_board(o);
  const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
  ASSERT_TRUE(e.answered()) << words(e);
  // 240 frames: their own scatter has a standard error of 4.6 %, their mean one of 2 ms / √240.
  EXPECT_NEAR(*extra(e, "stamp_jitter_s"), 2e-3, 4 * 0.046 * 2e-3);
  EXPECT_NEAR(*e.sigma_s, 2e-3 / std::sqrt(240.0), 3e-5);
  EXPECT_LT(std::abs(offset_error_s(e, run.truth)), sigmas * *e.sigma_s);
  EXPECT_TRUE(says(e, "jitter"));
}

TEST(BatchFaults, StraysGapsAndALateBoardAreBorne) {
  SimulatedBoard run = simulate_board(usual(2, 20), {.outlier_fraction = 0.03, .absent_until_s = 4});
  for (std::size_t k = 0; k < run.cameras[0].size(); ++k)
    if (k > 200 && k < 245) run.cameras[0].corners[k].clear();
  ImuStream gap = run.imus[0];
  gap.stamps.clear(), gap.gyro_rad_s.clear(), gap.accel_m_s2.clear();
  for (std::size_t i = 0; i < run.imus[0].size(); ++i) {
    if (i > 2700 && i < 2800) continue;
    gap.stamps.push_back(run.imus[0].stamps[i]);
    gap.gyro_rad_s.push_back(run.imus[0].gyro_rad_s[i]);
    gap.accel_m_s2.push_back(run.imus[0].accel_m_s2[i]);
  }
  expect_right(calibrate_batch(run.cameras[0], gap), run.truth);
}

// Longer than the biases' control points reach: those in the middle have no reading at all.
TEST(BatchFaults, ABoardThatIsAwayForTwentySecondsIsBorne) {
  SimulatedBoard run = simulate_board(usual(5, 40));
  for (std::size_t k = 0; k < run.cameras[0].size(); ++k)
    if (k > 160 && k < 600) run.cameras[0].corners[k].clear();
  expect_right(calibrate_batch(run.cameras[0], run.imus[0]), run.truth);
}

TEST(BatchFaults, AFrameWhereTheBoardCannotBeIsLeftOut) {
  CornerStream strange = recorded().cameras[0];
  strange.corners[100] = strange.corners[20];
  strange.corners[150] = strange.corners[60];
  const Estimate e = calibrate_batch(strange, recorded().imus[0]);
  expect_right(e, recorded().truth);
  EXPECT_TRUE(says(e, "left out")) << words(e);
}

TEST(BatchFaults, AnAccelerometerInGIsSaid) {
  ImuStream in_g = recorded().imus[0];
  for (Vec3& a : in_g.accel_m_s2) a /= 9.80665;
  const Estimate e = calibrate_batch(recorded().cameras[0], in_g);
  expect_right(e, recorded().truth);
  EXPECT_TRUE(says(e, "counts in g")) << words(e);
}

TEST(BatchFaults, AnAccelerometerInMillimetresIsAskedForItsUnit) {
  ImuStream in_mm = recorded().imus[0];
  for (Vec3& a : in_mm.accel_m_s2) a *= 1000;
  const Estimate e = calibrate_batch(recorded().cameras[0], in_mm);
  expect_refused(e);
  EXPECT_TRUE(says(e, "in which unit")) << words(e);
}

TEST(BatchFaults, AWrongBoardSizeIsSaid) {
  CornerStream wrong = recorded().cameras[0];
  for (Vec3& p : wrong.board) p *= 1.1;
  const Estimate e = calibrate_batch(wrong, recorded().imus[0]);
  expect_right(e, recorded().truth, Verdict::weak);
  EXPECT_TRUE(says(e, "times as large as the target file says")) << words(e);
  EXPECT_LT(pose_error(e, recorded().truth).second, 1e-3);
}

TEST(BatchFaults, WrongIntrinsicsAreNotTrusted) {
  CornerStream wrong = recorded().cameras[0];
  wrong.model->fx *= 1.01, wrong.model->fy *= 1.01;
  const Estimate e = calibrate_batch(wrong, recorded().imus[0], {.knots_s = 0.02});
  EXPECT_NE(e.verdict, Verdict::trusted) << words(e);
  EXPECT_EQ(*extra(plain(), "systematic_corner_error_px"), 0);
}

// A lens of another kind, fitted to this camera's own pictures, bends them by a few thousandths of a pixel otherwise,
// but puts the camera elsewhere by ten σ. The offset is right with either.
TEST(BatchFaults, ALensOfAnotherKindIsNotTrustedThoughItFits) {
  const CameraModel& truth = *recorded().cameras[0].model;
  for (const Distortion kind : {Distortion::radtan, Distortion::equidistant}) {
    const bool right = kind == Distortion::radtan;
    CornerStream mixed = recorded().cameras[0];
    const batch::CalibratedCamera fitted =
        batch::calibrate_intrinsics(mixed, truth.width, truth.height, {.distortion = kind});
    EXPECT_EQ(fitted.verdict, right ? Verdict::trusted : Verdict::weak);
    mixed.model = fitted.model;
    const Estimate e = calibrate_batch(mixed, recorded().imus[0], {.knots_s = 0.02});
    expect_right(e, recorded().truth, right ? Verdict::trusted : Verdict::weak);
    EXPECT_EQ(says(e, "a pinhole-radtan lens fits these corners better"), !right) << words(e);
  }
}

TEST(BatchFaults, AFastImuAndAFastCameraAreWelcome) {
  TargetFilmOptions o = usual(3, 8);
  o.imu.rate_hz = 1000;
  o.camera.rate_hz = 50;
  const SimulatedBoard run = simulate_board(o);
  expect_right(calibrate_batch(run.cameras[0], run.imus[0]), run.truth);
}

// --- Refusals ---

TEST(BatchRefuses, WhatCannotBeTold) {
  struct Case {
    const char *name, *reason;
    std::function<void(CornerStream&, ImuStream&)> spoil;
  };
  const std::vector<Case> refused = {
      {"a board never seen", "found in none",
       [](CornerStream& camera, ImuStream&) {
         for (auto& corners : camera.corners) corners.clear();
       }},
      {"a gyro alone", "accelerometer", [](CornerStream&, ImuStream& imu) { imu.accel_m_s2.clear(); }},
      {"degrees", "degrees a second",
       [](CornerStream&, ImuStream& imu) {
         for (Vec3& w : imu.gyro_rad_s) w *= 180 / std::numbers::pi;
       }},
      {"another time", "do not show the same motion",
       [](CornerStream&, ImuStream& imu) { imu = simulate_board(usual(77)).imus[0]; }},
      {"three frames", "",
       [](CornerStream& camera, ImuStream&) {
         camera.stamps.resize(3), camera.corners.resize(3), camera.exposures_s.resize(3);
       }},
  };
  for (const auto& [name, reason, spoil] : refused) {
    SCOPED_TRACE(name);
    CornerStream camera = recorded().cameras[0];
    ImuStream imu = recorded().imus[0];
    spoil(camera, imu);
    const Estimate e = calibrate_batch(camera, imu);
    expect_refused(e);
    EXPECT_TRUE(says(e, reason)) << words(e);
  }
}

TEST(BatchRefuses, ARigThatStoodStill) {
  TargetFilmOptions o = usual();
  o.motion = find_motion("still");
  const SimulatedBoard run = simulate_board(o);
  expect_refused(calibrate_batch(run.cameras[0], run.imus[0]));
}

TEST(BatchRefuses, OneAxisWithAdvice) {
  for (const std::uint64_t seed : {1, 2}) {
    TargetFilmOptions o = usual(seed);
    o.motion.freedom = Freedom::one;
    SimulatedBoard run = simulate_board(o);
    // Of the second so little that no offset stands out.
    if (seed == 2)
      for (std::size_t k = 70; k < run.cameras[0].size(); ++k) run.cameras[0].corners[k].clear();
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0]);
    EXPECT_NE(e.verdict, Verdict::trusted) << words(e);
    EXPECT_TRUE(says(e, "rotate it about the camera's")) << words(e);
    if (e.answered()) {
      EXPECT_LT(std::abs(offset_error_s(e, run.truth)), sigmas * *e.sigma_s) << words(e);
    }
  }
}

TEST(BatchRefuses, StreamsThatContradictThemselvesAreTheCallersFault) {
  CornerStream camera = recorded().cameras[0];
  camera.corners.pop_back();
  EXPECT_THROW((void)calibrate_batch(camera, recorded().imus[0]), std::invalid_argument);
  camera = recorded().cameras[0];
  camera.model.reset();
  EXPECT_THROW((void)calibrate_batch(camera, recorded().imus[0]), std::invalid_argument);
  EXPECT_THROW((void)calibrate_batch(recorded().cameras[0], recorded().imus[0], {.model = "cubic"}),
               std::invalid_argument);
}

// --- Statistics ---

TEST(BatchStatistics, ErrorsAreAsLargeAsTheirSigmas) {
  // 40 short recordings: Σz² of the offset, of three rotations and of three translations. Each bound is passed by
  // chance once in a thousand times: chi² with 40 and with 120 degrees of freedom. bench/accuracy/batch.txt has more.
  constexpr int runs = 40;
  double offset = 0, rotation = 0, place = 0;
  for (int seed = 1; seed <= runs; ++seed) {
    const SimulatedBoard run = simulate_board(usual(static_cast<std::uint64_t>(seed), 6));
    const Estimate e = calibrate_batch(run.cameras[0], run.imus[0], {.model = "discrete"});
    ASSERT_TRUE(e.answered()) << words(e);
    offset += std::pow(offset_error_s(e, run.truth) / *e.sigma_s, 2);
    const Rigid found = Rigid::from_matrix(*e.T_reference_sensor),
                is = Rigid::from_matrix(*run.truth.T_reference_sensor);
    const Vec3 turn = log_so3(is.rotation.conjugate() * found.rotation), shift = found.translation - is.translation;
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, "xyz"[i]);
      const auto sigma = [&](const std::string& name) {
        return *std::ranges::find(e.extras, name, &Extra::name)->sigma;
      };
      rotation += std::pow(turn[i] / sigma("rotation_" + axis + "_rad"), 2);
      place += std::pow(shift[i] / sigma("translation_" + axis + "_m"), 2);
    }
  }
  EXPECT_GT(offset, 17.9);
  EXPECT_LT(offset, 73.4);
  EXPECT_GT(rotation, 77.7);
  EXPECT_LT(rotation, 173.7);
  EXPECT_GT(place, 77.7);
  EXPECT_LT(place, 173.7);
}

// --- Board poses ---

TEST(BoardPose, IsFoundFrameByFrameWithHonestInformation) {
  const batch::BoardViews views = batch::find_board_poses(recorded().cameras[0], 2);
  EXPECT_EQ(views.views.size(), recorded().cameras[0].size());
  EXPECT_NEAR(views.corner_sigma_px, 0.07, 0.003);
  double chi2 = 0;
  for (const batch::BoardView& v : views.views) {
    const Exposure& at = recorded().film.exposures[0][v.frame];
    const Eigen::Isometry3d truth =
        cam_from_world(*recorded().film.trajectory, *recorded().cameras[0].T_body_cam, at.middle_s) *
        recorded().film.world_from_board;
    const Quat turn = v.T_cam_board.rotation * Quat(truth.linear()).conjugate();
    batch::Vec6 xi;
    xi << v.T_cam_board.translation - turn * truth.translation(), log_so3(turn);
    chi2 += xi.dot(v.information * xi) / (0.07 * 0.07);
  }
  // 240 frames of six: a standard deviation of 54.
  EXPECT_NEAR(chi2, 6.0 * static_cast<double>(views.views.size()), 4 * std::sqrt(12.0 * 240));
}

TEST(BoardPose, StraysAreLeftOut) {
  const SimulatedBoard run = simulate_board(usual(5, 3), {.outlier_fraction = 0.1});
  const batch::BoardViews views = batch::find_board_poses(run.cameras[0], 1);
  EXPECT_EQ(views.views.size(), run.cameras[0].size());
  EXPECT_NEAR(views.corner_sigma_px, 0.07, 0.005);
  EXPECT_GT(views.stray, 0.08 * 120 * 60);
}

TEST(BoardPose, CornersInOneLineAreNoPose) {
  CornerStream line = recorded().cameras[0];
  for (auto& corners : line.corners) std::erase_if(corners, [](const auto& c) { return c.corner >= 12; });
  EXPECT_TRUE(batch::find_board_poses(line, 1).views.empty());
}

}  // namespace
}  // namespace takt
