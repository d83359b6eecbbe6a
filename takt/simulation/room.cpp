// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/room.h"

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "takt/math/parallel.h"
#include "takt/simulation/random.h"

namespace takt {

namespace {

/// Three to five corners around a centre.
std::vector<cv::Point> shard(Random& random, double x, double y, double radius) {
  const int corners = 3 + static_cast<int>(random.uniform() * 3);
  const double turn = random.uniform(0, 2 * std::numbers::pi);
  std::vector<cv::Point> out;
  for (int i = 0; i < corners; ++i) {
    const double angle = turn + 2 * std::numbers::pi * (i + random.uniform(-0.25, 0.25)) / corners;
    out.emplace_back(static_cast<int>(std::lround(x + radius * std::cos(angle))),
                     static_cast<int>(std::lround(y + radius * std::sin(angle))));
  }
  return out;
}

Texture dead_leaves(int width, int height, Random random) {
  cv::Mat1b picture(height, width, std::uint8_t{128});
  const double largest = 0.15 * std::min(width, height), smallest = 5;
  // Sizes follow r⁻³, the law of dead leaves; the number of shards covers the wall some three times over.
  double area = 0;
  while (area < 3.0 * width * height) {
    const double u = random.uniform();
    const double radius = 1 / std::sqrt((1 - u) / (smallest * smallest) + u / (largest * largest));
    const auto corners = shard(random, random.uniform(0, width), random.uniform(0, height), radius);
    cv::fillConvexPoly(picture, corners, cv::Scalar(random.uniform(20, 235)));
    area += 1.5 * radius * radius;
  }
  cv::GaussianBlur(picture, picture, cv::Size(9, 9), 1.5);
  Texture out;
  out.width = width;
  out.height = height;
  out.texels.assign(picture.begin(), picture.end());
  return out;
}

}  // namespace

Room make_room(const Vec3& half_extent_m, double texel_m, std::uint64_t seed) {
  Room room{half_extent_m, texel_m, {}};
  const auto texels = [&](int axis) { return static_cast<int>(std::ceil(2 * half_extent_m[axis] / texel_m)) + 2; };
  parallel_for(6, 0, [&](int face) {
    const int axis = face / 2;
    room.faces[static_cast<std::size_t>(face)] =
        dead_leaves(texels(Room::u_axis(axis)), texels(Room::v_axis(axis)),
                    Random(mix64(seed) + static_cast<std::uint64_t>(face), "wall"));
  });
  return room;
}

std::vector<Vec3> landmarks_on_walls(const Vec3& half, int count, std::uint64_t seed) {
  Random random(seed, "landmarks");
  const std::array<double, 3> areas{half.y() * half.z(), half.z() * half.x(), half.x() * half.y()};
  const double total = areas[0] + areas[1] + areas[2];
  std::vector<Vec3> out;
  for (int i = 0; i < count; ++i) {
    const double pick = random.uniform(0, total);
    const int axis = pick < areas[0] ? 0 : pick < areas[0] + areas[1] ? 1 : 2;
    Vec3 p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    p[axis] = random.chance(0.5) ? 1 : -1;
    out.push_back(p.cwiseProduct(half));
  }
  return out;
}

}  // namespace takt
