// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/dial_angle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "takt/simulation/pendulum_film.h"

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;

/// Three seconds of a swinging rig: two swings, so that every part of the dial is passed in both directions.
PendulumRig short_rig() {
  PendulumRig rig = pendulum_rig("ordinary");
  rig.duration_s = 3;
  return rig;
}

struct Errors {
  double rms_px = 0, mean_px = 0;
};

Errors errors_of(const DialAngles& read, const PendulumFilm& film) {
  double n = 0, mean = 0, squares = 0;
  for (std::size_t i = 0; i < read.frame.size(); ++i) {
    const double e = (read.angles.angle_rad[i] - film.reading_rad[read.frame[i]]) / read.pixel_rad;
    ++n, mean += e, squares += e * e;
  }
  return {std::sqrt(squares / n - mean * mean / n / n), mean / n};
}

DialOptions options_for(DialMethod method) {
  DialOptions o;
  o.method = method;
  o.rest_reading_rad = 45.8 * deg;  // not quite: the graduations tell the rest
  return o;
}

struct View {
  const char* name;
  DialKind kind;
  double exposure_s, roll_deg, yaw_deg, focal_error;
};
class DialAngleViews : public testing::TestWithParam<View> {};

TEST_P(DialAngleViews, ReadToAFiftiethOfAPixel) {
  const View& v = GetParam();
  PendulumRig rig = short_rig();
  rig.camera.exposure_s = v.exposure_s;
  DialScene scene = dial_scene(v.kind);
  scene.view.roll_rad = v.roll_deg * deg;
  scene.view.yaw_rad = v.yaw_deg * deg;
  const PendulumFilm film = film_pendulum(rig, scene, 11, 1);
  DialView told = scene.view;
  told.camera.fx *= 1 + v.focal_error;
  told.camera.fy *= 1 + v.focal_error;
  const DialAngles read =
      dial_angles(film.camera, scene.dial, told,
                  options_for(v.kind == DialKind::coded ? DialMethod::coded : DialMethod::keyframes));
  ASSERT_EQ(read.angles.size(), film.reading_rad.size());
  EXPECT_EQ(read.left_out, 0u);
  const Errors e = errors_of(read, film);
  EXPECT_LT(e.rms_px, 0.02);
  // The dial is absolute; but where the radius through a turned camera is seen, only the focal length says.
  const double displaced = v.focal_error * told.camera.fx * std::tan(std::abs(v.yaw_deg) * deg);
  EXPECT_LT(std::abs(e.mean_px), 0.02 + displaced);
  EXPECT_NEAR(read.scale, 1 + v.focal_error, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(All, DialAngleViews,
                         testing::Values(View{"coded", DialKind::coded, 1e-3, 0, 0, 0},
                                         View{"coded_rolled", DialKind::coded, 1e-3, 30, 0, 0},
                                         View{"coded_yaw_and_focal", DialKind::coded, 2e-3, 0, 2, 0.015},
                                         View{"plain", DialKind::plain, 1.5e-3, 0, 0, 0},
                                         View{"plain_rolled", DialKind::plain, 1e-3, -30, 0, 0}),
                         [](const auto& test) { return test.param.name; });

TEST(DialAngle, NeighboursAddUpTheirErrors) {
  const DialScene scene = dial_scene(DialKind::plain);
  const PendulumFilm film = film_pendulum(short_rig(), scene, 12, 1);
  const Errors added = errors_of(dial_angles(film.camera, scene.dial, scene.view, options_for(DialMethod::neighbours)),
                                 film),
               kept = errors_of(dial_angles(film.camera, scene.dial, scene.view, options_for(DialMethod::keyframes)),
                                film);
  EXPECT_LT(added.rms_px, 0.3);
  EXPECT_LT(kept.rms_px, 0.3 * added.rms_px);
}

TEST(DialAngle, IsTheSameForAnyNumberOfThreads) {
  PendulumRig rig = short_rig();
  rig.duration_s = 1.5;
  const DialScene scene = dial_scene(DialKind::coded);
  const PendulumFilm film = film_pendulum(rig, scene, 13, 1);
  DialOptions one, three;
  one.threads = 1;
  three.threads = 3;
  EXPECT_EQ(dial_angles(film.camera, scene.dial, scene.view, one).angles.angle_rad,
            dial_angles(film.camera, scene.dial, scene.view, three).angles.angle_rad);
}

/// Spoils chosen frames of a film.
class SpoiltReader final : public FrameReader {
 public:
  enum class Fault { glare, blank, repeat };
  SpoiltReader(std::unique_ptr<FrameReader> reader, std::map<std::size_t, Fault> faults)
      : reader_(std::move(reader)), faults_(std::move(faults)) {}
  std::optional<Frame> next() override {
    auto frame = reader_->next();
    if (!frame) return frame;
    if (const auto fault = faults_.find(frame->index); fault != faults_.end()) spoil(*frame, fault->second);
    last_ = frame->image;
    return frame;
  }

 private:
  void spoil(Frame& frame, Fault fault) {
    if (fault == Fault::repeat) {
      frame.image = last_;
      return;
    }
    const auto pixels = std::make_shared<std::vector<std::uint8_t>>(640 * 480, fault == Fault::blank ? 60 : 255);
    if (fault == Fault::glare)  // over half the width
      for (int y = 0; y < 480; ++y) std::copy_n(frame.image.row(y), 320, pixels->begin() + 640 * y);
    frame.image.pixels = pixels->data();
    frame.image.owner = pixels;
  }
  std::unique_ptr<FrameReader> reader_;
  std::map<std::size_t, Fault> faults_;
  GrayImage last_;
};

TEST(DialAngle, BadFramesAreLeftOutAndSaid) {
  const DialScene scene = dial_scene(DialKind::coded);
  PendulumFilm film = film_pendulum(short_rig(), scene, 14, 1);
  using enum SpoiltReader::Fault;
  const std::map<std::size_t, SpoiltReader::Fault> faults{{20, glare}, {50, blank}, {51, blank}, {90, repeat}};
  film.camera.open = [open = film.camera.open, faults] { return std::make_unique<SpoiltReader>(open(), faults); };
  DialOptions options;
  options.threads = 1;  // "the frame before" is the reader's
  const DialAngles read = dial_angles(film.camera, scene.dial, scene.view, options);
  EXPECT_EQ(read.left_out, 4u);
  for (const std::size_t frame : read.frame) EXPECT_FALSE(faults.contains(frame)) << frame;
  EXPECT_LT(errors_of(read, film).rms_px, 0.02);
  ASSERT_EQ(read.notes.size(), 1u);
  EXPECT_EQ(read.notes[0],
            "4 of 150 frames were left out: 1 repeat the picture before them, 1 are overexposed, 2 are "
            "blurred or too dark");
}

struct Shutter {
  const char* name;
  DialKind kind;
  double roll_deg, line_delay_s;
  bool own_print = false;  ///< on the dial is not what was told
};
class RollingShutters : public testing::TestWithParam<Shutter> {};

TEST_P(RollingShutters, GiveEachReadingTheRowItWasTakenAt) {
  const Shutter& v = GetParam();
  PendulumRig rig = short_rig();
  rig.camera.line_delay_s = v.line_delay_s;
  DialScene scene = dial_scene(v.kind);
  scene.view.roll_rad = v.roll_deg * deg;
  const PendulumFilm film = film_pendulum(rig, scene, 15, 1);
  DialOptions options = options_for(v.kind == DialKind::coded ? DialMethod::coded : DialMethod::keyframes);
  Dial told = scene.dial;
  if (v.own_print) {
    told.kind = DialKind::plain;  // the code's edge lies within a strip of the plain dial
    options = options_for(DialMethod::keyframes);
    options.rest_reading_rad = 45 * deg;
  }
  const DialAngles read = dial_angles(film.camera, told, scene.view, options);
  ASSERT_EQ(read.angles.rows.size(), read.angles.size());
  ASSERT_EQ(read.angles.size(), 2 * film.reading_rad.size());
  // Each reading is the angle at its own row's time; and what is left does not go with the speed, which would be time.
  const PendulumMotion motion(rig.pendulum, rig.start_angle_rad, 0, rig.duration_s);
  double squares = 0, late = 0, speeds = 0, later_by_row = 0, rows_squared = 0, middle = 0, mean = 0;
  for (const double row : read.angles.rows) middle += row / static_cast<double>(read.angles.size());
  for (std::size_t i = 0; i < read.angles.size(); ++i) {
    const double t = seconds_since(from_ns(rig.epoch_ns), read.angles.stamps[i]) + read.angles.rows[i] * v.line_delay_s;
    const PendulumState truth = motion.at(t);
    const double e = read.angles.angle_rad[i] - 45 * deg - truth.angle;
    squares += e * e / static_cast<double>(read.angles.size());
    mean += e / static_cast<double>(read.angles.size());
    late += e * truth.rate, speeds += truth.rate * truth.rate;
    const double rows = read.angles.rows[i] - middle;
    later_by_row += e * truth.rate * rows, rows_squared += truth.rate * truth.rate * rows * rows;
  }
  if (v.own_print) squares -= mean * mean;  // such a dial is not absolute
  EXPECT_LT(std::sqrt(squares) / read.pixel_rad, 0.03);
  EXPECT_LT(std::abs(late / speeds), 2e-6);
  EXPECT_LT(std::abs(later_by_row / rows_squared), 0.1e-6) << "the line delay's error";
}

INSTANTIATE_TEST_SUITE_P(All, RollingShutters,
                         testing::Values(Shutter{"square", DialKind::coded, 0, 2e-5},
                                         Shutter{"rolled", DialKind::coded, 30, 2e-5},
                                         Shutter{"rolled_and_slow", DialKind::coded, -30, 6e-5},
                                         Shutter{"rolled_plain", DialKind::plain, 30, 2e-5},
                                         Shutter{"own_print", DialKind::coded, 0, 4e-5, true}),
                         [](const auto& test) { return test.param.name; });

TEST(DialAngle, RefusesWhatItCannotSee) {
  DialScene scene = dial_scene(DialKind::plain);
  const PendulumFilm film = film_pendulum(short_rig(), scene, 16, 1);
  EXPECT_THROW(static_cast<void>(dial_angles(film.camera, scene.dial, scene.view)), std::invalid_argument)
      << "no code on a plain dial";
  scene.view.height_m = 3;
  EXPECT_THROW(static_cast<void>(dial_angles(film.camera, scene.dial, scene.view, options_for(DialMethod::keyframes))),
               std::invalid_argument);
}

}  // namespace
}  // namespace takt
