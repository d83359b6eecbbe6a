// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/offset_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "takt/signals/track_rotation.h"
#include "takt/simulation/handheld.h"

namespace takt {
namespace {

HandheldOptions options(const char* motion, double duration_s, std::uint64_t seed) {
  HandheldOptions o;
  o.seed = seed;
  o.duration_s = duration_s;
  o.motion = find_motion(motion);
  o.footage = Footage::tracks;
  o.tracking.pixel_noise_px = 1;
  return o;
}

TrackingRig rig_of(const Recording& r) {
  TrackingRig rig;
  rig.imu_name = r.imus.front().name;
  rig.imu_noise = r.imus.front().noise;
  for (const TrackStream& t : r.tracks)
    rig.cameras.push_back({t.name, t.model, t.timing, *t.T_body_cam, t.pixel_sigma});
  return rig;
}

OffsetTracker tracker_for(const TrackingRig& rig, const TrackingOptions& how) {
  return OffsetTracker(rig, how, [](const TrackStream& t) { return track_rotation(t); });
}
OffsetTracker tracker_for(const Recording& r, const TrackingOptions& how = {}) {
  return tracker_for(rig_of(r), how);
}

/// Everything in order of its stamp; `spoil` may change samples on the way.
template <class Each>
void feed(OffsetTracker& tracker, const Recording& r, const Each& each) {
  const ImuStream& imu = r.imus.front();
  std::vector<std::size_t> at(r.tracks.size(), 0);
  for (std::size_t i = 0; i < imu.size(); ++i) {
    for (std::size_t c = 0; c < r.tracks.size(); ++c)
      for (; at[c] < r.tracks[c].size() && r.tracks[c].stamps[at[c]] <= imu.stamps[i]; ++at[c]) {
        tracker.observe_frame(c, {r.tracks[c].stamps[at[c]], 0, r.tracks[c].features[at[c]]});
        each();
      }
    tracker.observe_imu({imu.stamps[i], imu.gyro_rad_s[i], imu.accel_m_s2[i]});
  }
  tracker.finish();
}
void feed(OffsetTracker& tracker, const Recording& r) {
  feed(tracker, r, [] {});
}

double error_s(const Estimate& e, const SimulatedRecording& made) {
  return to_seconds(*e.offset - made.truth.clock_map().offset_at(as<SensorClock>(e.epoch)));
}

/// What every method must do.
class TrackingLaws : public testing::TestWithParam<std::string> {
 protected:
  static TrackingOptions how() {
    TrackingOptions o;
    o.method = GetParam();
    return o;
  }
};
INSTANTIATE_TEST_SUITE_P(EveryMethod, TrackingLaws, testing::ValuesIn(tracking_methods()),
                         [](const auto& method) { return method.param; });

TEST_P(TrackingLaws, FindsTheOffsetFromNothing) {
  const SimulatedRecording made = simulate_handheld(options("handheld", 10, 11));
  OffsetTracker tracker = tracker_for(made.recording, how());
  feed(tracker, made.recording);
  const Estimate e = tracker.result();
  ASSERT_TRUE(e.answered());
  EXPECT_EQ(e.verdict, Verdict::trusted);
  EXPECT_LT(*e.sigma_s, 1.5e-4);
  EXPECT_LT(std::abs(error_s(e, made)), 4 * *e.sigma_s);
}

TEST_P(TrackingLaws, IsTheSameEachTime) {
  const SimulatedRecording made = simulate_handheld(options("handheld", 5, 12));
  OffsetTracker first = tracker_for(made.recording, how()), second = tracker_for(made.recording, how());
  feed(first, made.recording);
  feed(second, made.recording);
  ASSERT_TRUE(first.result().answered());
  EXPECT_EQ(first.result().offset, second.result().offset);
  EXPECT_EQ(first.result().sigma_s, second.result().sigma_s);
}

TEST_P(TrackingLaws, ComesFromHalfASecondAway) {
  for (const double offset_s : {0.5, -0.5}) {
    HandheldOptions o = options("handheld", 7, 13);
    o.offset_s = offset_s;
    const SimulatedRecording made = simulate_handheld(o);
    OffsetTracker tracker = tracker_for(made.recording, how());
    feed(tracker, made.recording);
    const Estimate e = tracker.result();
    ASSERT_TRUE(e.answered());
    EXPECT_LT(std::abs(error_s(e, made)), 4 * *e.sigma_s);
  }
}

TEST_P(TrackingLaws, EachCameraHasItsOwn) {
  HandheldOptions o = options("handheld", 7, 14);
  o.stereo = true, o.stereo_offset_s = 0.004;
  const SimulatedRecording made = simulate_handheld(o);
  OffsetTracker tracker = tracker_for(made.recording, how());
  feed(tracker, made.recording);
  const Estimate left = tracker.result(0), right = tracker.result(1);
  ASSERT_TRUE(left.answered() && right.answered());
  const double sigma = std::hypot(*left.sigma_s, *right.sigma_s);
  EXPECT_NEAR(to_seconds(*right.offset - *left.offset), 0.004, 4 * sigma);
  EXPECT_LT(sigma, 5e-4);
}

double extra(const Estimate& e, const std::string& name, double* sigma) {
  for (const Extra& x : e.extras)
    if (x.name == name) {
      *sigma = *x.sigma;
      return x.value;
    }
  ADD_FAILURE() << "there is no " << name;
  return 0;
}

TEST_P(TrackingLaws, FindsTheLineDelayWhenAsked) {
  HandheldOptions o = options("handheld", 8, 21);
  o.camera.readout_s = 0.025;
  const SimulatedRecording made = simulate_handheld(o);
  TrackingRig rig = rig_of(made.recording);
  const double truth_s = rig.cameras[0].timing.line_delay_s();
  rig.cameras[0].timing.readout_s = 0.019;
  TrackingOptions asked = how();
  asked.line_delay = true;
  OffsetTracker tracker = tracker_for(rig, asked);
  feed(tracker, made.recording);
  const Estimate e = tracker.result();
  ASSERT_TRUE(e.answered() && e.line_delay_sigma_s);
  EXPECT_LT(*e.line_delay_sigma_s, 1e-6);
  EXPECT_LT(std::abs(*e.line_delay_s - truth_s), 4 * *e.line_delay_sigma_s);
  EXPECT_LT(std::abs(error_s(e, made)), 4 * *e.sigma_s);
}

TEST_P(TrackingLaws, FindsTheMounting) {
  const SimulatedRecording made = simulate_handheld(options("handheld", 8, 22));
  TrackingRig rig = rig_of(made.recording);
  const Mat4 truth = rig.cameras[0].T_imu_cam;
  const Vec3 turned(5e-3, -6e-3, 4e-3);
  rig.cameras[0].T_imu_cam.topLeftCorner<3, 3>() *= exp_so3(turned).toRotationMatrix();
  OffsetTracker tracker = tracker_for(rig, how());
  feed(tracker, made.recording);
  const Estimate e = tracker.result();
  ASSERT_TRUE(e.answered() && e.T_reference_sensor);
  const Mat3 off = truth.topLeftCorner<3, 3>().transpose() * e.T_reference_sensor->topLeftCorner<3, 3>();
  const Vec3 turn = log_so3(Quat(off).normalized());
  const char* const names[] = {"rotation_x_rad", "rotation_y_rad", "rotation_z_rad"};
  for (int i = 0; i < 3; ++i) {
    double sigma = 0;
    (void)extra(e, names[i], &sigma);
    EXPECT_LT(sigma, 1.5e-3);
    EXPECT_LT(std::abs(turn[i]), 4 * sigma) << i;
  }
  EXPECT_LT(std::abs(error_s(e, made)), 4 * *e.sigma_s);
}

TEST_P(TrackingLaws, FindsTheIntrinsicsWhenAsked) {
  const SimulatedRecording made = simulate_handheld(options("handheld", 8, 23));
  TrackingRig rig = rig_of(made.recording);
  const CameraModel truth = rig.cameras[0].model;
  CameraModel& given = rig.cameras[0].model;
  given.fx += 5, given.fy += 3, given.cx -= 4, given.cy += 4;
  TrackingOptions asked = how();
  asked.refine_intrinsics = true;
  OffsetTracker tracker = tracker_for(rig, asked);
  feed(tracker, made.recording);
  const Estimate e = tracker.result();
  ASSERT_TRUE(e.answered());
  EXPECT_LT(std::abs(error_s(e, made)), 4 * *e.sigma_s);
  if (GetParam() == "filter") {
    // It lets them vary for the offset's sake, and claims nothing.
    for (const Extra& x : e.extras) EXPECT_NE(x.name, "fx_px");
    return;
  }
  const std::pair<const char*, double> known[] = {
      {"fx_px", truth.fx}, {"fy_px", truth.fy}, {"cx_px", truth.cx}, {"cy_px", truth.cy}};
  for (const auto& [name, value] : known) {
    double sigma = 0;
    const double found = extra(e, name, &sigma);
    EXPECT_LT(sigma, 2) << name;
    EXPECT_LT(std::abs(found - value), 4 * sigma) << name;
  }
}

TEST_P(TrackingLaws, RefusesWhatDoesNotTell) {
  for (const char* motion : {"still", "constant_velocity", "constant_rate"}) {
    const SimulatedRecording made = simulate_handheld(options(motion, 6, 15));
    OffsetTracker tracker = tracker_for(made.recording, how());
    feed(tracker, made.recording);
    const Estimate e = tracker.result();
    EXPECT_EQ(e.verdict, Verdict::refused) << motion;
    ASSERT_FALSE(e.reasons.empty());
    EXPECT_NE(e.reasons.front().find("not observable"), std::string::npos) << e.reasons.front();
  }
}

TEST_P(TrackingLaws, HoldsWhatItKnowsWhileStanding) {
  // Stands from 9 s to 15 s.
  const SimulatedRecording made = simulate_handheld(options("stops", 14.9, 16));
  OffsetTracker tracker = tracker_for(made.recording, how());
  std::optional<double> held, sigma;
  feed(tracker, made.recording, [&] {
    const OffsetNow now = tracker.estimate();
    if (now.state != TrackingState::holding || !now.offset) return;
    if (!held) held = to_seconds(*now.offset), sigma = *now.sigma_s;
    EXPECT_NEAR(to_seconds(*now.offset), *held, 5e-4);
    EXPECT_GE(*now.sigma_s, 0.98 * *sigma);
    EXPECT_NE(now.reasons.front().find("not been observable"), std::string::npos);
  });
  ASSERT_TRUE(held);
  EXPECT_EQ(tracker.estimate().state, TrackingState::holding);
  EXPECT_LT(std::abs(error_s(tracker.result(), made)), 4 * *tracker.result().sigma_s);
}

/// How often an answer was trusted, which it must not be while it is off; after eight seconds, by when it is known
/// whether the clocks run apart.
struct Trust {
  std::size_t said_late = 0, late = 0;
};
Trust feed_and_watch(OffsetTracker& tracker, const SimulatedRecording& made) {
  Trust trust;
  const Stamp settled = made.recording.tracks.front().stamps.front() + std::chrono::seconds(8);
  feed(tracker, made.recording, [&] {
    const OffsetNow now = tracker.estimate();
    if (!now.offset) return;
    trust.said_late += now.stamp > settled;
    if (now.verdict != Verdict::trusted) return;
    trust.late += now.stamp > settled;
    const Duration truth = made.truth.clock_map().offset_at(as<SensorClock>(now.stamp));
    EXPECT_LT(std::abs(to_seconds(*now.offset - truth)), 4 * *now.sigma_s) << seconds_since(settled, now.stamp);
  });
  return trust;
}

TEST_P(TrackingLaws, FollowsADriftAndIsNotTrustedBeforeItIsKnown) {
  HandheldOptions o = options("handheld", 12, 19);
  o.drift = 75e-6;
  const SimulatedRecording made = simulate_handheld(o);
  OffsetTracker tracker = tracker_for(made.recording, how());
  feed_and_watch(tracker, made);
  const Estimate e = tracker.result();
  ASSERT_TRUE(e.answered());
  EXPECT_EQ(e.verdict, Verdict::trusted);
  EXPECT_LT(std::abs(error_s(e, made)), 2e-4);
  EXPECT_NEAR(*e.drift, 75e-6, 4 * *e.drift_sigma);
}

TEST_P(TrackingLaws, FollowsAStepAndIsNotTrustedBeforeItHas) {
  HandheldOptions o = options("handheld", 24, 17);
  o.step_s = 0.005, o.step_at_s = 12;
  const SimulatedRecording made = simulate_handheld(o);
  OffsetTracker tracker = tracker_for(made.recording, how());
  const Trust trust = feed_and_watch(tracker, made);
  EXPECT_GT(trust.late, 3 * trust.said_late / 4);
  const Estimate e = tracker.result();
  ASSERT_TRUE(e.answered());
  EXPECT_EQ(tracker.counts().steps, 1u);
  EXPECT_LT(std::abs(error_s(e, made)), 2e-4);
}

TEST_P(TrackingLaws, BadDataAreLeftOutAndSaid) {
  const SimulatedRecording made = simulate_handheld(options("handheld", 5, 18));
  OffsetTracker tracker = tracker_for(made.recording, how());
  const ImuSample bad{made.recording.imus[0].stamps[20], Vec3::Constant(std::numeric_limits<double>::quiet_NaN()),
                      Vec3::Zero()};
  std::size_t frames = 0;
  feed(tracker, made.recording, [&] {
    tracker.observe_imu(bad);
    const TrackStream& t = made.recording.tracks[0];
    if (++frames % 3 == 0) tracker.observe_frame(0, {t.stamps[0], 0, t.features[0]});
    tracker.observe_frame(0, {t.stamps[frames - 1], 0, {{1, Vec2(NAN, 3)}, {1, Vec2(1e300, -1e300)}}});
  });
  const Estimate e = tracker.result();
  ASSERT_TRUE(e.answered());
  EXPECT_LT(std::abs(error_s(e, made)), 4 * *e.sigma_s);
  std::string notes;
  for (const std::string& n : e.notes) notes += n + "\n";
  EXPECT_NE(notes.find("not finite"), std::string::npos) << notes;
  EXPECT_NE(notes.find("twice"), std::string::npos) << notes;
}

TEST(OffsetTracker, NamesABrokenContract) {
  EXPECT_THROW(OffsetTracker({}, {}, {}), std::invalid_argument);
  const SimulatedRecording made = simulate_handheld(options("handheld", 1, 1));
  TrackingOptions how;
  how.method = "guess";
  EXPECT_THROW(tracker_for(made.recording, how), std::invalid_argument);
}

}  // namespace
}  // namespace takt
