// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/renderer.h"

#include <algorithm>
#include <cmath>

#include "takt/math/parallel.h"

namespace takt {

namespace {

constexpr int rows_a_strip = 16;
constexpr int most_instants = 16;

}  // namespace

Renderer::Renderer(std::shared_ptr<const Trajectory> truth, const SimulatedCamera& camera,
                   std::shared_ptr<const Room> room, ImageNoise noise, std::uint64_t seed)
    : truth_(std::move(truth)), camera_(camera), model_(camera.model()), room_(std::move(room)), noise_(noise, seed) {
  bearings_.reserve(static_cast<std::size_t>(model_.width) * static_cast<std::size_t>(model_.height));
  for (int y = 0; y < model_.height; ++y)
    for (int x = 0; x < model_.width; ++x) {
      const auto b = model_.bearing(Vec2(x, y));
      bearings_.push_back(b ? Eigen::Vector3f(b->cast<float>()) : Eigen::Vector3f(0, 0, 0));
    }
}

Renderer::Pose Renderer::pose_at(double t_s) const {
  const Eigen::Isometry3d pose = truth_->world_from_body(t_s) * Eigen::Isometry3d(camera_.T_body_cam);
  return {pose.linear().cast<float>(), pose.translation().cast<float>()};
}

int Renderer::instants(const Exposure& e) const {
  const double near_m = 1.5;  // most of what is seen lies farther
  const double rate = truth_->omega_body(e.middle_s).norm() + truth_->velocity_world(e.middle_s).norm() / near_m;
  return std::clamp(static_cast<int>(std::ceil(rate * e.exposure_s * model_.fx)), 1, most_instants);
}

GrayImage Renderer::render(std::size_t index, const Exposure& e, int threads) const {
  const auto width = static_cast<std::size_t>(model_.width);
  const auto pixels = std::make_shared<std::vector<std::uint8_t>>(width * static_cast<std::size_t>(model_.height));
  const int n = instants(e);
  const double line_delay = camera_.timing().line_delay_s();
  const auto instant = [&](int i) { return e.middle_s + ((i + 0.5) / n - 0.5) * e.exposure_s; };
  std::vector<Pose> global;
  if (line_delay == 0)
    for (int i = 0; i < n; ++i) global.push_back(pose_at(instant(i)));

  const int strips = (model_.height + rows_a_strip - 1) / rows_a_strip;
  parallel_for(strips, threads, [&](int strip) {
    std::vector<float> sum(width);
    const int end = std::min(model_.height, (strip + 1) * rows_a_strip);
    for (int y = strip * rows_a_strip; y < end; ++y) {
      std::fill(sum.begin(), sum.end(), 0.0f);
      for (int i = 0; i < n; ++i)
        add_row(y, line_delay == 0 ? global[static_cast<std::size_t>(i)] : pose_at(instant(i) + y * line_delay),
                sum.data());
      noise_.finish_row(index, y, sum.data(), 1.0f / static_cast<float>(n), model_.width,
                        pixels->data() + static_cast<std::size_t>(y) * width);
    }
  });

  GrayImage image;
  image.width = model_.width;
  image.height = model_.height;
  image.stride = model_.width;
  image.pixels = pixels->data();
  image.owner = pixels;
  return image;
}

void Renderer::add_row(int y, const Pose& pose, float* sum) const {
  const Eigen::Vector3f* bearings = bearings_.data() + static_cast<std::ptrdiff_t>(y) * model_.width;
  const Eigen::Vector3f half = room_->half_extent_m.cast<float>();
  const auto per_m = static_cast<float>(1 / room_->texel_m);
  int axis = 0;  // neighbours mostly see the same wall: it is tried first
  for (int x = 0; x < model_.width; ++x) {
    if (bearings[x].isZero(0)) continue;  // the lens sees nothing here
    const Eigen::Vector3f d = pose.rotation * bearings[x];
    for (int tries = 0; tries < 3; ++tries, axis = Room::u_axis(axis)) {
      const int u = Room::u_axis(axis), v = Room::v_axis(axis);
      const float distance = (std::copysign(half[axis], d[axis]) - pose.position[axis]) / d[axis];
      const float at_u = pose.position[u] + distance * d[u], at_v = pose.position[v] + distance * d[v];
      // From inside a box a ray leaves through the wall whose plane it meets within the wall. Just at an edge rounding
      // may deny it to both walls; the third try then settles for any.
      if ((std::abs(at_u) > half[u] || std::abs(at_v) > half[v]) && tries < 2) continue;
      const Texture& wall = room_->faces[static_cast<std::size_t>(2 * axis + (d[axis] > 0 ? 1 : 0))];
      sum[x] += wall.at((at_u + half[u]) * per_m, (at_v + half[v]) * per_m);
      break;
    }
  }
}

}  // namespace takt
