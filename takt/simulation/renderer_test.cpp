// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "takt/simulation/motion.h"
#include "takt/simulation/tracks.h"

namespace takt {
namespace {

const Vec3 half_extent(3, 2.5, 1.5);

/// Dark walls with bright round blobs, whose centres are known in the world.
Room room_with_blobs(std::vector<Vec3>& centres) {
  Room room{half_extent, 0.005, {}};
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, u = Room::u_axis(axis), v = Room::v_axis(axis);
    Texture& t = room.faces[static_cast<std::size_t>(face)];
    t.width = static_cast<int>(2 * half_extent[u] / room.texel_m) + 2;
    t.height = static_cast<int>(2 * half_extent[v] / room.texel_m) + 2;
    t.texels.assign(static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.height), 20);
    for (int cy = 60; cy + 60 < t.height; cy += 113)
      for (int cx = 60; cx + 60 < t.width; cx += 127) {
        for (int y = cy - 20; y <= cy + 20; ++y)
          for (int x = cx - 20; x <= cx + 20; ++x)
            t.texels[static_cast<std::size_t>(y * t.width + x)] = static_cast<std::uint8_t>(
                std::lround(20 + 200 * std::exp(-0.5 * ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / 6.25)));
        Vec3 p;
        p[axis] = face % 2 ? half_extent[axis] : -half_extent[axis];
        p[u] = cx * room.texel_m - half_extent[u];
        p[v] = cy * room.texel_m - half_extent[v];
        centres.push_back(p);
      }
  }
  return room;
}

/// Where the brightness around a pixel has its centre.
Vec2 centroid(const GrayImage& image, const Vec2& near) {
  const int reach = 9, cx = static_cast<int>(std::lround(near.x())), cy = static_cast<int>(std::lround(near.y()));
  Vec2 sum(0, 0);
  double mass = 0;
  for (int y = cy - reach; y <= cy + reach; ++y)
    for (int x = cx - reach; x <= cx + reach; ++x) {
      const double w = std::max(0, image.row(y)[x] - 24);
      sum += w * Vec2(x, y);
      mass += w;
    }
  return sum / mass;
}

struct Setup {
  friend std::ostream& operator<<(std::ostream& out, const Setup& s) { return out << s.name; }
  const char* name;
  Distortion lens;
  double readout_s;
  double exposure_s;
};

class RendererGeometry : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(All, RendererGeometry,
                         testing::Values(Setup{"pinhole", Distortion::none, 0, 0},
                                         Setup{"radtan", Distortion::radtan, 0, 0},
                                         Setup{"fisheye", Distortion::equidistant, 0, 0},
                                         Setup{"rolling", Distortion::none, 0.03, 0},
                                         Setup{"exposed", Distortion::none, 0, 0.008},
                                         Setup{"rolling_exposed_radtan", Distortion::radtan, 0.03, 0.008}),
                         [](const auto& row) { return row.param.name; });

TEST_P(RendererGeometry, APointOnAWallIsWhereTheCameraModelProjectsIt) {
  std::vector<Vec3> centres;
  const auto room = std::make_shared<const Room>(room_with_blobs(centres));
  SimulatedCamera camera;
  camera.lens = GetParam().lens;
  camera.readout_s = GetParam().readout_s;
  camera.exposure_s = GetParam().exposure_s;
  Motion motion = find_motion("handheld");
  motion.turn_calm_rad_s = motion.turn_lively_rad_s = 1;
  const auto truth = make_trajectory(motion, 11);
  const Renderer renderer(truth, camera, room, {0, 0}, 1);
  const CameraModel model = camera.model();
  int seen = 0;
  double worst = 0, sum2 = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    const double t = 0.7 * static_cast<double>(k) + 0.3;
    const GrayImage image = renderer.render(k, {t, camera.exposure_s, {}}, 2);
    const FrameView view(*truth, camera, model, t);
    for (const Vec3& centre : centres) {
      // Blobs seen at a slant have their centroid off their centre's projection: only those seen well face on.
      const Eigen::Isometry3d pose = cam_from_world(*truth, camera.T_body_cam, t);
      const Vec3 ray = (centre - pose.inverse().translation()).normalized();
      if ((ray.array().abs() * (centre.array().abs() > half_extent.array() - 1e-9).cast<double>()).sum() < 0.85)
        continue;
      const auto expected = view.pixel_of(centre);
      if (!expected || expected->x() < 20 || expected->y() < 20 || expected->x() > model.width - 21 ||
          expected->y() > model.height - 21)
        continue;
      const double error = (centroid(image, *expected) - *expected).norm();
      worst = std::max(worst, error);
      sum2 += error * error;
      ++seen;
    }
  }
  ASSERT_GT(seen, 50);
  // A blob of σ = 1.25 cm tilted by up to 32° at 1.5 to 3 m has its centroid off by f·σ²·tan/Z² < 0.02 px; a
  // half-pixel or half-texel convention mixed up would be 0.5.
  EXPECT_LT(std::sqrt(sum2 / seen), 0.05);
  EXPECT_LT(worst, 0.2);
}

TEST(Renderer, ThePictureIsTheSameForAnyNumberOfThreads) {
  const auto room = std::make_shared<const Room>(make_room(half_extent, 0.02, 5));
  SimulatedCamera camera;
  camera.readout_s = 0.02;
  const auto truth = make_trajectory(find_motion("handheld"), 5);
  const Renderer renderer(truth, camera, room, {}, 5);
  const GrayImage one = renderer.render(3, {1, 0.005, {}}, 1), two = renderer.render(3, {1, 0.005, {}}, 2);
  const GrayImage again = Renderer(truth, camera, room, {}, 5).render(3, {1, 0.005, {}}, 3);
  const std::size_t size = static_cast<std::size_t>(one.width) * static_cast<std::size_t>(one.height);
  EXPECT_EQ(std::memcmp(one.pixels, two.pixels, size), 0);
  EXPECT_EQ(std::memcmp(one.pixels, again.pixels, size), 0);
  const GrayImage next = renderer.render(4, {1, 0.005, {}}, 1);
  EXPECT_NE(std::memcmp(one.pixels, next.pixels, size), 0);  // its noise is its own
}

TEST(Renderer, NoiseHasTheStatedVariance) {
  Room grey{half_extent, 0.05, {}};
  for (int face = 0; face < 6; ++face) {
    Texture& t = grey.faces[static_cast<std::size_t>(face)];
    t.width = t.height = 130;
    t.texels.assign(130 * 130, 100);
  }
  const ImageNoise noise{3, 0.07};
  const Renderer renderer(make_trajectory(find_motion("still"), 1), SimulatedCamera{}, std::make_shared<Room>(grey),
                          noise, 1);
  const GrayImage image = renderer.render(0, {0.1, 0, {}}, 0);
  double sum = 0, sum2 = 0;
  const int n = image.width * image.height;
  for (int i = 0; i < n; ++i) {
    sum += image.pixels[i];
    sum2 += image.pixels[i] * image.pixels[i];
  }
  const double mean = sum / n;
  EXPECT_NEAR(mean, 100, 0.05);
  // 16 and rounding's 1/12; the relative σ of a variance from 307 200 pixels is 0.26 %, 4σ is 1 %.
  EXPECT_NEAR(sum2 / n - mean * mean, 16 + 1.0 / 12, 0.17);
}

TEST(Renderer, ExposureBlursAlongTheMotion) {
  const auto room = std::make_shared<const Room>(make_room(half_extent, 0.005, 2));
  SimulatedCamera camera;
  Motion spin = find_motion("handheld");
  spin.turn_calm_rad_s = spin.turn_lively_rad_s = 3;
  const Renderer renderer(make_trajectory(spin, 2), camera, room, {0, 0}, 1);
  const auto sharpness = [&](double exposure_s) {
    double sum = 0;
    for (const double t : {1.0, 2.0, 3.0}) {
      const GrayImage image = renderer.render(0, {t, exposure_s, {}}, 0);
      for (int i = 0; i + 1 < image.width * image.height; ++i) sum += std::abs(image.pixels[i + 1] - image.pixels[i]);
    }
    return sum;
  };
  EXPECT_LT(sharpness(0.02), 0.8 * sharpness(0.0));
}

TEST(Room, WallsAreTexturedAndLandmarksLieOnThem) {
  const Room room = make_room(half_extent, 0.02, 3);
  for (const Texture& wall : room.faces) {
    double sum = 0, sum2 = 0;
    for (const std::uint8_t t : wall.texels) {
      sum += t;
      sum2 += t * t;
    }
    const double n = static_cast<double>(wall.texels.size());
    EXPECT_GT(std::sqrt(sum2 / n - sum / n * sum / n), 30);
  }
  for (const Vec3& p : landmarks_on_walls(half_extent, 500, 3)) {
    EXPECT_TRUE((p.array().abs() <= half_extent.array() + 1e-12).all());
    EXPECT_NEAR((p.cwiseQuotient(half_extent)).cwiseAbs().maxCoeff(), 1, 1e-12);
  }
}

}  // namespace
}  // namespace takt
