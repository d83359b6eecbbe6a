// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/handheld.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

namespace takt {
namespace {

HandheldOptions tracks_options() {
  HandheldOptions o;
  o.footage = Footage::tracks;
  o.duration_s = 6;
  o.camera.exposure_s = 0.008;
  return o;
}

/// Maps a frame to the IMU's clock as an estimator's user would: its stamp, moved to the exposure's middle, through the
/// truth; what comes out is when the IMU reports the same motion.
double imu_says_at(const SimulatedRecording& made, Stamp stamp, const FrameTiming& timing, double exposure_s) {
  const auto middle = as<SensorClock>(stamp) + from_seconds(timing.to_exposure_middle_s(exposure_s));
  return seconds_since(made.clocks.reference_start, made.truth.clock_map()(middle));
}

struct ClockCase {
  double offset_s, drift;
  ExposureInstant stamp;
  LowPassKind low_pass;
  double stamp_delay_s;
};

TEST(Handheld, TheTruthMapsEachFrameToTheIMUSampleOfTheSameMotion) {
  for (const ClockCase& c : {ClockCase{0.0123, 0, ExposureInstant::middle, LowPassKind::none, 0},
                             ClockCase{-3.7, 50e-6, ExposureInstant::start, LowPassKind::none, 0.002},
                             ClockCase{86400.5, -200e-6, ExposureInstant::end, LowPassKind::fir, 0}}) {
    HandheldOptions o = tracks_options();
    o.offset_s = c.offset_s;
    o.drift = c.drift;
    o.camera.stamp = c.stamp;
    o.camera.exposure_swing = 0.4;
    o.imu.low_pass = c.low_pass;
    o.imu.stamp_delay_s = c.stamp_delay_s;
    const SimulatedRecording made = simulate_handheld(o);
    const TrackStream& cam = made.recording.tracks.front();
    ASSERT_EQ(cam.size(), made.exposures.size());
    for (std::size_t i = 0; i < cam.size(); ++i) {
      const Exposure& e = made.exposures[i];
      const double t = imu_says_at(made, cam.stamps[i], cam.timing, e.exposure_s);
      EXPECT_NEAR(t, e.middle_s + o.imu.delay_s(), 3e-9) << i;
    }
    EXPECT_NEAR(to_seconds(*made.truth.offset), c.offset_s + o.imu.delay_s(), 1e-9);
  }
}

TEST(Handheld, TheGyroMeasuresTheTrajectoryAtItsMappedTimes) {
  HandheldOptions o = tracks_options();
  o.imu.noise = {};
  o.imu.gyro_bias_rad_s = 0;
  o.imu.stamp_delay_s = 0.004;
  const SimulatedRecording made = simulate_handheld(o);
  const ImuStream& imu = made.recording.imus.front();
  // From the IMU's stamps back to the camera's clock through the truth, and from there to true time by the clocks
  // alone.
  const auto to_camera = inverse(made.truth.clock_map());
  const auto to_true = made.clocks.sensor_to_reference(o.duration_s);
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const double t = seconds_since(made.clocks.reference_start, to_true(to_camera(as<ReferenceClock>(imu.stamps[i]))));
    EXPECT_LT((imu.gyro_rad_s[i] - made.trajectory->omega_body(t)).norm(), 1e-6);
  }
}

TEST(Handheld, StampsRiseInAllStreams) {
  HandheldOptions o = tracks_options();
  o.camera.jitter_s = o.imu.jitter_s = 0.02;
  o.camera.drop_fraction = o.imu.drop_fraction = 0.2;
  const SimulatedRecording made = simulate_handheld(o);
  const auto& frames = made.recording.tracks.front().stamps;
  const auto& samples = made.recording.imus.front().stamps;
  EXPECT_TRUE(std::is_sorted(frames.begin(), frames.end(), std::less_equal<>{}));
  EXPECT_TRUE(std::is_sorted(samples.begin(), samples.end(), std::less_equal<>{}));
  EXPECT_LT(frames.size(), 110u);
  EXPECT_GT(frames.size(), 70u);
}

TEST(Handheld, EveryExposureLiesWithinTheIMUsSpan) {
  HandheldOptions o = tracks_options();
  o.camera.readout_s = 0.03;
  const SimulatedRecording made = simulate_handheld(o);
  for (const Exposure& e : made.exposures) {
    EXPECT_GE(e.middle_s - 0.5 * e.exposure_s, 0);
    EXPECT_LE(e.middle_s + 0.5 * e.exposure_s + o.camera.readout_s, o.duration_s);
  }
}

TEST(Handheld, ARollingShutterSeesEachLandmarkWhenItsRowIsRead) {
  HandheldOptions o = tracks_options();
  o.camera.readout_s = 0.025;
  o.tracking.pixel_noise_px = 0;
  const SimulatedRecording made = simulate_handheld(o);
  const TrackStream& cam = made.recording.tracks.front();
  const auto landmarks = landmarks_on_walls(o.motion.room_half_extent_m, o.tracking.landmarks, o.seed);
  // Independent of the solver: the ray through the seen pixel, at its row's own time, must meet a landmark.
  std::size_t met = 0, rays = 0;
  for (std::size_t i = 0; i < cam.size(); i += 20)
    for (const TrackedFeature& f : cam.features[i]) {
      const double t = made.exposures[i].middle_s + f.pixel.y() * cam.timing.line_delay_s();
      const Eigen::Isometry3d pose = cam_from_world(*made.trajectory, o.camera.T_body_cam, t).inverse();
      const Vec3 ray = pose.linear() * *cam.model.bearing(f.pixel);
      ++rays;
      met += std::any_of(landmarks.begin(), landmarks.end(), [&](const Vec3& p) {
        const Vec3 to = p - pose.translation();
        return to.cross(ray).norm() < 1e-8 && to.dot(ray) > 0;
      });
    }
  EXPECT_GT(rays, 200u);
  EXPECT_EQ(met, rays);
}

TEST(Handheld, TrackedFeaturesKeepTheirIdWithoutAGapAndThePixelNoiseIsTheStated) {
  HandheldOptions o = tracks_options();
  o.tracking.pixel_noise_px = 0.7;
  const SimulatedRecording noisy = simulate_handheld(o);
  o.tracking.pixel_noise_px = 0;
  const SimulatedRecording exact = simulate_handheld(o);
  const TrackStream& cam = noisy.recording.tracks.front();
  std::map<std::int64_t, std::size_t> last;
  std::size_t observations = 0;
  for (std::size_t i = 0; i < cam.size(); ++i) {
    std::set<std::int64_t> ids;
    for (const TrackedFeature& f : cam.features[i]) {
      EXPECT_TRUE(ids.insert(f.id).second) << "twice in a frame";
      const auto seen = last.find(f.id);
      EXPECT_TRUE(seen == last.end() || seen->second + 1 == i) << "id " << f.id << " after a gap";
      last[f.id] = i;
    }
    EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
    observations += ids.size();
  }
  EXPECT_GT(observations / cam.size(), 50u);
  // Ids agree between the runs until noise moves a feature over the image's edge, so the first frames compare.
  double sum2 = 0;
  int n = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    std::map<std::int64_t, Vec2> truth;
    for (const TrackedFeature& f : exact.recording.tracks.front().features[i]) truth[f.id] = f.pixel;
    for (const TrackedFeature& f : cam.features[i])
      if (const auto it = truth.find(f.id); it != truth.end() && (f.pixel - it->second).norm() < 5) {
        sum2 += (f.pixel - it->second).squaredNorm();
        n += 2;
      }
  }
  // Relative σ of the variance is √(2/n); 4σ.
  EXPECT_GT(n, 400);
  EXPECT_NEAR(sum2 / n, 0.49, 4 * std::sqrt(2.0 / n) * 0.49);
}

TEST(Handheld, OutliersAreAsManyAsAsked) {
  HandheldOptions o = tracks_options();
  o.tracking.pixel_noise_px = 0;
  o.tracking.outlier_fraction = 0.1;
  const SimulatedRecording made = simulate_handheld(o);
  const TrackStream& cam = made.recording.tracks.front();
  const auto landmarks = landmarks_on_walls(o.motion.room_half_extent_m, o.tracking.landmarks, o.seed);
  double n = 0, out = 0;
  for (std::size_t i = 0; i < cam.size(); i += 10) {
    const FrameView view(*made.trajectory, o.camera, cam.model, made.exposures[i].middle_s);
    std::vector<Vec2> places;
    for (const Vec3& p : landmarks)
      if (const auto pixel = view.pixel_of(p)) places.push_back(*pixel);
    for (const TrackedFeature& f : cam.features[i]) {
      ++n;
      out += std::none_of(places.begin(), places.end(), [&](const Vec2& p) { return (p - f.pixel).norm() < 1e-6; });
    }
  }
  // Outliers that would leave the image are not reported, so there are a few less.
  EXPECT_LT(out / n, 0.1 + 4 * std::sqrt(0.09 / n));
  EXPECT_GT(out / n, 0.085 - 4 * std::sqrt(0.09 / n));
}

HandheldOptions small_images() {
  HandheldOptions o;
  o.duration_s = 0.5;
  o.camera.width = 160;
  o.camera.height = 120;
  o.motion.room_half_extent_m = Vec3(2, 2, 1.5);
  return o;
}

TEST(Handheld, PicturesAreRenderedWhenReadAndTheSameEachTime) {
  HandheldOptions o = small_images();
  o.camera.readout_s = 0.02;
  o.threads = 1;
  const SimulatedRecording one = simulate_handheld(o);
  o.threads = 2;
  const SimulatedRecording two = simulate_handheld(o);
  const CameraStream& cam = one.recording.cameras.front();
  const auto first = cam.open(), again = cam.open(), other = two.recording.cameras.front().open();
  std::size_t frames = 0;
  while (const auto frame = first->next()) {
    const auto same = again->next(), threaded = other->next();
    ASSERT_TRUE(same && threaded);
    EXPECT_EQ(frame->index, frames);
    EXPECT_EQ(frame->stamp, cam.stamps[frames]);
    EXPECT_EQ(std::memcmp(frame->image.pixels, same->image.pixels, 160 * 120), 0);
    EXPECT_EQ(std::memcmp(frame->image.pixels, threaded->image.pixels, 160 * 120), 0);
    ++frames;
  }
  EXPECT_EQ(frames, cam.size());
  EXPECT_FALSE(again->next());
}

TEST(Handheld, ASeedIsARecording) {
  HandheldOptions o = tracks_options();
  o.duration_s = 1;
  const SimulatedRecording a = simulate_handheld(o), b = simulate_handheld(o);
  o.seed = 2;
  const SimulatedRecording c = simulate_handheld(o);
  EXPECT_EQ(a.recording.imus.front().gyro_rad_s, b.recording.imus.front().gyro_rad_s);
  EXPECT_EQ(a.recording.tracks.front().stamps, b.recording.tracks.front().stamps);
  EXPECT_NE(a.recording.imus.front().gyro_rad_s, c.recording.imus.front().gyro_rad_s);
  EXPECT_NE(a.recording.tracks.front().stamps, c.recording.tracks.front().stamps);
}

TEST(Handheld, RefusesAnExposureLongerThanTheFrameInterval) {
  HandheldOptions o = tracks_options();
  o.camera.exposure_s = 0.06;
  EXPECT_THROW(simulate_handheld(o), std::invalid_argument);
}

}  // namespace
}  // namespace takt
