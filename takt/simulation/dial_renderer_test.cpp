// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/dial_renderer.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

#include "takt/simulation/pendulum_film.h"

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;

DialScene quiet_scene() {
  DialScene scene = dial_scene(DialKind::coded);
  scene.noise = {.read = 0, .shot = 0};
  scene.texture = 0;
  scene.vignetting = 0;
  return scene;
}

bool same(const GrayImage& a, const GrayImage& b) {
  return std::memcmp(a.pixels, b.pixels, static_cast<std::size_t>(a.height * a.stride)) == 0;
}

TEST(DialRenderer, PutsEachCellWhereThePerspectiveFormulaSaysIt) {
  const DialScene scene = quiet_scene();
  const double reading = 45.1 * deg, f = scene.view.camera.fx, R = scene.view.radius_m, l = scene.view.pivot_distance_m;
  const GrayImage image = DialRenderer(scene, 1).render(
      0, [&](double) { return reading; }, 1, 1e-3, 0, 1);
  const int row = 240 + static_cast<int>(0.01 * f / (R - l));  // 1 cm below the middle: among the cells
  int seen = 0;
  for (long cell = 130; cell < 230; ++cell) {
    const double alpha = (static_cast<double>(cell) + 0.5) * scene.dial.cell_deg * deg - reading;
    const double u = scene.view.camera.cx + f * R * std::sin(alpha) / (R * std::cos(alpha) - l);
    if (u < 5 || u > 634) continue;
    const int grey = image.row(row)[static_cast<int>(std::lround(u))];
    EXPECT_EQ(grey < 110, dial_cell(cell)) << cell << " at " << u << ": " << grey;
    ++seen;
  }
  EXPECT_GT(seen, 90);
}

TEST(DialRenderer, IsTheSameForAnyNumberOfThreads) {
  const DialRenderer renderer(dial_scene(DialKind::plain), 3);
  const auto swing = [](double t) { return 0.8 + 0.7 * t; };
  for (const double line_delay : {0.0, 2e-5}) {
    const GrayImage one = renderer.render(7, swing, 0.1, 1e-3, line_delay, 1),
                    three = renderer.render(7, swing, 0.1, 1e-3, line_delay, 3);
    EXPECT_TRUE(same(one, three));
    EXPECT_FALSE(same(one, renderer.render(8, swing, 0.1, 1e-3, line_delay, 3))) << "noise of another frame";
  }
}

TEST(DialRenderer, RollingShutterShearsThePicture) {
  const DialRenderer renderer(quiet_scene(), 1);
  const double speed = 1.0, line_delay = 1e-5;
  const auto swing = [&](double t) { return 0.785 + speed * t; };
  const GrayImage rolling = renderer.render(0, swing, 0, 0, line_delay, 1);
  for (const int y : {0, 240, 300, 479}) {
    const GrayImage still = renderer.render(
        0, [&](double) { return swing(y * line_delay); }, 0, 0, 0, 1);
    EXPECT_EQ(std::memcmp(rolling.row(y), still.row(y), 640), 0) << y;
  }
}

TEST(DialView, ProjectsBackWhatItSees) {
  DialView view = dial_scene(DialKind::coded).view;
  view.roll_rad = 30 * deg;
  view.yaw_rad = 0.05;
  view.pitch_rad = -0.03;
  view.height_m = 0.01;
  for (const Vec2& pixel : {Vec2(3, 470), Vec2(320, 240), Vec2(600, 20)}) {
    const auto point = view.at(pixel);
    ASSERT_TRUE(point);
    const auto back = view.project(*point);
    ASSERT_TRUE(back);
    EXPECT_LT((*back - pixel).norm(), 1e-8);
  }
  // 30° clockwise: the dial runs to the lower right.
  view.yaw_rad = view.pitch_rad = 0;
  const Vec2 step = *view.project({0.01, 0.01}) - *view.project({0, 0.01});
  EXPECT_NEAR(std::atan2(step.y(), step.x()), 30 * deg, 1e-3);
}

TEST(PendulumFilm, StampsAreThoseOfTheAngles) {
  PendulumRig rig = pendulum_rig("ordinary");
  rig.duration_s = 2;
  rig.camera.stamp = ExposureInstant::end;
  rig.camera.angle_noise_rad = 0;
  const PendulumFilm film = film_pendulum(rig, dial_scene(DialKind::coded), 5);
  const PendulumRecording angles = simulate_pendulum(rig, 5);
  ASSERT_EQ(film.camera.stamps, angles.dial.stamps);
  for (std::size_t i = 0; i < film.reading_rad.size(); ++i)
    EXPECT_NEAR(film.reading_rad[i] - 45 * deg, angles.dial.angle_rad[i], 1e-12);
  const auto reader = film.camera.open();
  reader->skip_to(3);
  EXPECT_EQ(reader->next()->index, 3u);
}

}  // namespace
}  // namespace takt
