// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/dial_renderer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "takt/math/parallel.h"
#include "takt/simulation/random.h"

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr int texels_a_pixel = 6;
constexpr int rows_a_strip = 32;
constexpr int most_instants = 24;
constexpr double beyond_deg = 25;  // the wall to both sides of the dial
constexpr double beyond_height_m = 0.02;

/// Moving average of an odd width along a line; the ends are repeated.
void box_blur(std::vector<float>& line, int width) {
  const int half = width / 2, n = static_cast<int>(line.size());
  const auto at = [&line, n](int i) { return line[static_cast<std::size_t>(std::clamp(i, 0, n - 1))]; };
  std::vector<float> out(line.size());
  double sum = 0;
  for (int i = -half; i <= half; ++i) sum += at(i);
  for (int i = 0; i < n; ++i) {
    out[static_cast<std::size_t>(i)] = static_cast<float>(sum / (2 * half + 1));
    sum += at(i + half + 1) - at(i - half);
  }
  line.swap(out);
}

}  // namespace

DialScene dial_scene(DialKind kind) {
  DialScene scene;
  scene.dial.kind = kind;
  scene.view.camera = CameraModel::from_horizontal_fov(640, 480, 2 * std::atan(18.0 / 25));
  return scene;
}

DialRenderer::DialRenderer(const DialScene& scene, std::uint64_t seed) : scene_(scene), noise_(scene.noise, seed) {
  check(scene.dial);
  texel_rad_ = scene.view.pixel_rad() / texels_a_pixel;
  first_rad_ = (scene.dial.from_deg - beyond_deg) * deg;
  columns_ = static_cast<int>((scene.dial.to_deg - scene.dial.from_deg + 2 * beyond_deg) * deg / texel_rad_) + 2;
  top_m_ = 0.5 * scene.dial.height_m + beyond_height_m;
  rows_ = static_cast<int>(std::ceil(2 * top_m_ / row_m_));
  paint(seed);
  blur_along();

  const CameraModel& camera = scene.view.camera;
  const double half_diagonal = 0.5 * std::hypot(camera.width, camera.height);
  looks_.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const auto point = scene.view.at(Vec2(x, y));
      if (!point) {
        looks_.push_back({0, 0, 0});
        continue;
      }
      const double r = std::hypot(x - camera.cx, y - camera.cy) / half_diagonal;
      const int row = std::clamp(static_cast<int>((top_m_ - point->height_m) / row_m_), 0, rows_ - 1);
      looks_.push_back({static_cast<float>((point->angle_rad - first_rad_) / texel_rad_), row * columns_,
                        static_cast<float>(1 - scene.vignetting * r * r)});
    }
}

void DialRenderer::paint(std::uint64_t seed) {
  Random grain(seed, "paper");
  texture_.resize(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_));
  for (int row = 0; row < rows_; ++row) {
    const double height = top_m_ - (row + 0.5) * row_m_;
    for (int i = 0; i < columns_; ++i) {
      const double angle = first_rad_ + i * texel_rad_;
      const bool on_paper = std::abs(height) < 0.5 * scene_.dial.height_m && angle > scene_.dial.from_deg * deg &&
                            angle < scene_.dial.to_deg * deg;
      // A texel is finer than the grain, which the blur then leaves with about its contrast.
      const double rough = scene_.texture * 3.5 * (2 * grain.uniform() - 1) * 1.73;
      double grey = scene_.wall_grey * (1 + 2 * rough);
      if (on_paper) {
        const double black = ink_share(scene_.dial, angle - 0.5 * texel_rad_, angle + 0.5 * texel_rad_, height);
        grey = (scene_.paper_grey + black * (scene_.ink_grey - scene_.paper_grey)) * (1 + rough);
      }
      texture_[static_cast<std::size_t>(row * columns_ + i)] = static_cast<float>(grey);
    }
  }
}

/// What the pixel's width and the lens do to the picture along the dial; two boxes make a fair bell.
void DialRenderer::blur_along() {
  const double lens = scene_.blur_px * texels_a_pixel * std::sqrt(12.0 / 2);
  const int lens_box = 2 * static_cast<int>(lens / 2) + 1, pixel_box = texels_a_pixel | 1;
  std::vector<float> line(static_cast<std::size_t>(columns_));
  for (int row = 0; row < rows_; ++row) {
    const auto from = texture_.begin() + static_cast<std::ptrdiff_t>(row) * columns_;
    std::copy(from, from + columns_, line.begin());
    for (const int width : {pixel_box, lens_box, lens_box}) box_blur(line, width);
    std::copy(line.begin(), line.end(), from);
  }
}

GrayImage DialRenderer::render(std::size_t index, const std::function<double(double)>& reading_rad, double middle_s,
                               double exposure_s, double line_delay_s, int threads) const {
  const int width = scene_.view.camera.width, height = scene_.view.camera.height;
  const auto pixels = std::make_shared<std::vector<std::uint8_t>>(looks_.size());
  const double smear_px =
      std::abs(reading_rad(middle_s + 0.5 * exposure_s) - reading_rad(middle_s - 0.5 * exposure_s)) /
      scene_.view.pixel_rad();
  const int n = std::clamp(static_cast<int>(std::ceil(2 * smear_px)) + 1, 2, most_instants);
  const auto columns_at = [&](double row) {
    std::vector<float> out;
    for (int i = 0; i < n; ++i)
      out.push_back(static_cast<float>(reading_rad(middle_s + row * line_delay_s + ((i + 0.5) / n - 0.5) * exposure_s) /
                                       texel_rad_));
    return out;
  };
  const std::vector<float> global = columns_at(0);
  const auto last = static_cast<float>(columns_ - 2);
  parallel_for((height + rows_a_strip - 1) / rows_a_strip, threads, [&](int strip) {
    std::vector<float> sum(static_cast<std::size_t>(width));
    for (int y = strip * rows_a_strip; y < std::min(height, (strip + 1) * rows_a_strip); ++y) {
      const Look* look = looks_.data() + static_cast<std::ptrdiff_t>(y) * width;
      const std::vector<float> moved = line_delay_s == 0 ? global : columns_at(y);
      for (int x = 0; x < width; ++x) {
        float grey = 0;
        for (const float m : moved) {
          const float at = std::clamp(look[x].column + m, 0.0f, last);
          const int i = static_cast<int>(at);
          const float* texel = texture_.data() + look[x].row + i;
          grey += texel[0] + (at - static_cast<float>(i)) * (texel[1] - texel[0]);
        }
        sum[static_cast<std::size_t>(x)] = grey * look[x].light;
      }
      noise_.finish_row(index, y, sum.data(), 1.0f / static_cast<float>(n), width,
                        pixels->data() + static_cast<std::ptrdiff_t>(y) * width);
    }
  });
  GrayImage image;
  image.width = width;
  image.height = height;
  image.stride = width;
  image.pixels = pixels->data();
  image.owner = pixels;
  return image;
}

}  // namespace takt
