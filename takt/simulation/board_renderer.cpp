// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/board_renderer.h"

#include <algorithm>
#include <cmath>

#include "takt/math/parallel.h"
#include "takt/simulation/random.h"

namespace takt {

namespace {

constexpr int rows_a_strip = 32;
constexpr int most_instants = 16;
constexpr int most_texels = 3072;  // along the longer side of the paper
constexpr int wall_texels = 1024;
constexpr int wall_coarser = 4;  // than the print

/// Along one axis: how much of each texel lies between two places (in texels).
struct Cover {
  int first = 0;
  std::vector<float> share;
};
Cover cover(double from, double to, int count) {
  Cover out;
  from = std::clamp(from, 0.0, static_cast<double>(count)), to = std::clamp(to, 0.0, static_cast<double>(count));
  out.first = static_cast<int>(from);
  for (int i = out.first; i < to; ++i)
    out.share.push_back(static_cast<float>(std::min(to, i + 1.0) - std::max(from, static_cast<double>(i))));
  return out;
}

/// Share of a unit texel inside a disc; 16 × 16 points where its edge may pass.
float disc_share(const Vec2& centre, double radius, int x, int y) {
  const double distance = (Vec2(x + 0.5, y + 0.5) - centre).norm();
  if (distance < radius - 0.75) return 1;
  if (distance > radius + 0.75) return 0;
  int inside = 0;
  for (int i = 0; i < 256; ++i)
    if ((Vec2(x + (i % 16 + 0.5) / 16, y + (i / 16 + 0.5) / 16) - centre).squaredNorm() < radius * radius) ++inside;
  return static_cast<float>(inside) / 256;
}

/// Weights of the fine samples (two a pixel) from −6 to +5 about a pixel's first one: the pixel's width and the lens.
std::vector<float> blur_weights(double sigma_px) {
  std::vector<float> weights(12);
  double total = 0;
  for (int i = 0; i < 12; ++i) {
    double w = 0;
    for (const double half : {-0.25, 0.25}) {
      const double at = 0.5 * (i - 5) - 0.25 - half;
      w += sigma_px > 0.05 ? std::exp(-0.5 * at * at / (sigma_px * sigma_px)) : (std::abs(at) < 0.2 ? 1 : 0);
    }
    weights[static_cast<std::size_t>(i)] = static_cast<float>(w);
    total += w;
  }
  for (float& w : weights) w = static_cast<float>(w / total);
  return weights;
}

constexpr int halo = 5;  // fine samples before a pixel's first one that its blur reaches; one more behind

}  // namespace

BoardRenderer::BoardRenderer(std::shared_ptr<const Trajectory> truth, const SimulatedCamera& camera,
                             const PrintedBoard& scene, std::uint64_t seed)
    : truth_(std::move(truth)),
      camera_(camera),
      model_(camera.model()),
      scene_(scene),
      noise_(scene.noise, seed),
      blur_(blur_weights(scene.blur_px)) {
  check(scene.target);
  print(scene.target);
  paint_wall(seed);
  const int width = 2 * model_.width, height = 2 * model_.height;
  bearings_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto b = model_.bearing(Vec2(0.5 * x - 0.25, 0.5 * y - 0.25));
      bearings_.push_back(b ? Eigen::Vector3f(b->cast<float>()) : Eigen::Vector3f(0, 0, 0));
    }
}

void BoardRenderer::print(const Target& target) {
  const BoardExtent ink = board_extent(target);
  const Vec2 margin = Vec2::Constant(0.06 * (ink.high - ink.low).maxCoeff());
  low_m_ = ink.low - margin, high_m_ = ink.high + margin;
  const Vec2 size = high_m_ - low_m_;
  texel_m_ = size.maxCoeff() / most_texels;
  Plane fine;
  fine.width = static_cast<int>(std::ceil(size.x() / texel_m_ / 8)) * 8;
  fine.height = static_cast<int>(std::ceil(size.y() / texel_m_ / 8)) * 8;
  std::vector<float> share(static_cast<std::size_t>(fine.width) * static_cast<std::size_t>(fine.height), 0.0f);
  const auto at = [&](int x, int y) -> float& {
    return share[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine.width) + static_cast<std::size_t>(x)];
  };
  for (const InkShape& s : board_ink(target)) {
    const Vec2 low = (s.low - low_m_) / texel_m_, high = (s.high - low_m_) / texel_m_;
    const float sign = s.black ? 1.0f : -1.0f;  // white lies on black
    const Cover across = cover(low.x(), high.x(), fine.width), along = cover(low.y(), high.y(), fine.height);
    for (std::size_t j = 0; j < along.share.size(); ++j)
      for (std::size_t i = 0; i < across.share.size(); ++i) {
        const int x = across.first + static_cast<int>(i), y = along.first + static_cast<int>(j);
        at(x, y) +=
            sign * (s.kind == InkShape::Kind::rectangle ? across.share[i] * along.share[j]
                                                        : disc_share(0.5 * (low + high), 0.5 * (high - low).x(), x, y));
      }
  }
  fine.texels.resize(share.size());
  const auto paper = static_cast<float>(scene_.paper_grey), black = static_cast<float>(scene_.ink_grey);
  for (std::size_t i = 0; i < share.size(); ++i)
    fine.texels[i] = static_cast<std::uint8_t>(paper + std::clamp(share[i], 0.0f, 1.0f) * (black - paper) + 0.5f);
  prints_.push_back(std::move(fine));
  while (prints_.size() < 4) {
    const Plane& from = prints_.back();
    Plane half{from.width / 2, from.height / 2, {}};
    half.texels.resize(static_cast<std::size_t>(half.width) * static_cast<std::size_t>(half.height));
    for (int y = 0; y < half.height; ++y) {
      const std::uint8_t* row = from.texels.data() + static_cast<std::ptrdiff_t>(2 * y) * from.width;
      for (int x = 0; x < half.width; ++x)
        half.texels[static_cast<std::size_t>(y * half.width + x)] = static_cast<std::uint8_t>(
            (row[2 * x] + row[2 * x + 1] + row[from.width + 2 * x] + row[from.width + 2 * x + 1] + 2) / 4);
    }
    prints_.push_back(std::move(half));
  }
}

/// Rectangles of all shades, without sharp edges: a wall with things on it.
void BoardRenderer::paint_wall(std::uint64_t seed) {
  Random random(seed, "wall");
  wall_ = {wall_texels, wall_texels, {}};
  std::vector<float> grey(static_cast<std::size_t>(wall_texels * wall_texels), static_cast<float>(scene_.wall_grey));
  for (int n = 0; n < 300; ++n) {
    const int w = 10 + static_cast<int>(random.uniform() * 120), h = 10 + static_cast<int>(random.uniform() * 120);
    const int x0 = static_cast<int>(random.uniform() * wall_texels),
              y0 = static_cast<int>(random.uniform() * wall_texels);
    const auto shade = static_cast<float>(scene_.wall_grey * random.uniform(0.6, 1.5));
    for (int y = y0; y < y0 + h; ++y)
      for (int x = x0; x < x0 + w; ++x)
        grey[static_cast<std::size_t>((y % wall_texels) * wall_texels + x % wall_texels)] = shade;
  }
  wall_.texels.reserve(grey.size());
  for (const float g : grey) wall_.texels.push_back(static_cast<std::uint8_t>(std::clamp(g, 0.0f, 255.0f)));
}

BoardRenderer::ToTexels BoardRenderer::to_texels(double t_s) const {
  const Eigen::Isometry3d board_from_cam =
      (cam_from_world(*truth_, camera_.T_body_cam, t_s) * scene_.world_from_board).inverse();
  const Mat3 R = board_from_cam.linear();
  const Vec3 c = board_from_cam.translation();
  // A ray c + s·R·d meets z = 0 at s = −c_z/(R·d)_z; both are scaled by −(R·d)_z/c_z = 1/s, which is positive ahead.
  Mat3 map;
  map.row(2) = -R.row(2) / c.z();
  map.row(0) = (R.row(0) + (c.x() - low_m_.x()) * map.row(2)) / texel_m_;
  map.row(1) = (R.row(1) + (c.y() - low_m_.y()) * map.row(2)) / texel_m_;
  return map.cast<float>();
}

int BoardRenderer::instants(const Exposure& e) const {
  const Eigen::Isometry3d cam = cam_from_world(*truth_, camera_.T_body_cam, e.middle_s) * scene_.world_from_board;
  const double near_m = std::max(0.1, 0.7 * cam.translation().norm());
  const double rate = truth_->omega_body(e.middle_s).norm() + truth_->velocity_world(e.middle_s).norm() / near_m;
  return std::clamp(static_cast<int>(std::ceil(rate * e.exposure_s * model_.fx)), 1, most_instants);
}

/// The print whose texels are about as wide as a fine sample.
std::size_t BoardRenderer::level(double t_s) const {
  const Eigen::Isometry3d cam = cam_from_world(*truth_, camera_.T_body_cam, t_s) * scene_.world_from_board;
  const Vec2 middle = 0.5 * (low_m_ + high_m_);
  const double distance = (cam * Vec3(middle.x(), middle.y(), 0)).norm();
  const double texels = 0.5 * distance / model_.fx / texel_m_;
  return static_cast<std::size_t>(
      std::clamp(std::lround(std::log2(texels)), 0L, static_cast<long>(prints_.size()) - 1));
}

GrayImage BoardRenderer::render(std::size_t index, const Exposure& e, int threads) const {
  const int width = model_.width, height = model_.height, fine_width = 2 * width;
  const auto pixels =
      std::make_shared<std::vector<std::uint8_t>>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const int n = instants(e);
  const double line_delay = camera_.timing().line_delay_s();
  const auto instant = [&](int i) { return e.middle_s + ((i + 0.5) / n - 0.5) * e.exposure_s; };
  const std::size_t mip = level(e.middle_s);
  const auto scale = static_cast<float>(1.0 / (1 << mip));
  const bool bare = e.middle_s < scene_.appears_s;

  parallel_for((height + rows_a_strip - 1) / rows_a_strip, threads, [&](int strip) {
    const int begin = strip * rows_a_strip, end = std::min(height, begin + rows_a_strip);
    const int fine_begin = 2 * begin - halo, fine_end = 2 * end + halo + 1;
    // A strip takes a millisecond at most: in between, poses are straight to 1e-4 px.
    std::vector<std::array<ToTexels, 2>> maps;
    for (int i = 0; i < n; ++i)
      maps.push_back({to_texels(instant(i) + begin * line_delay), to_texels(instant(i) + end * line_delay)});
    std::vector<float> fine(static_cast<std::size_t>(fine_width)), padded(static_cast<std::size_t>(fine_width + 12));
    std::vector<float> across(static_cast<std::size_t>((fine_end - fine_begin) * width));
    for (int fy = fine_begin; fy < fine_end; ++fy) {
      std::fill(fine.begin(), fine.end(), 0.0f);
      const auto part = static_cast<float>(0.5 * fy - 0.25 - begin) / static_cast<float>(end - begin);
      for (const auto& [first, last] : maps)
        add_row(std::clamp(fy, 0, 2 * height - 1), first + part * (last - first), prints_[mip], scale, bare,
                fine.data());
      for (int x = 0; x < fine_width + 12; ++x)
        padded[static_cast<std::size_t>(x)] = fine[static_cast<std::size_t>(std::clamp(x - halo, 0, fine_width - 1))];
      float* out = across.data() + static_cast<std::ptrdiff_t>(fy - fine_begin) * width;
      for (int x = 0; x < width; ++x) {
        const float* in = padded.data() + 2 * x;
        float sum = 0;
        for (std::size_t k = 0; k < 12; ++k) sum += blur_[k] * in[k];
        out[x] = sum;
      }
    }
    std::vector<float> row(static_cast<std::size_t>(width));
    for (int y = begin; y < end; ++y) {
      std::fill(row.begin(), row.end(), 0.0f);
      for (std::size_t k = 0; k < 12; ++k) {
        const float* in = across.data() + static_cast<std::ptrdiff_t>(2 * (y - begin) + static_cast<int>(k)) * width;
        for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] += blur_[k] * in[x];
      }
      noise_.finish_row(index, y, row.data(), 1.0f / static_cast<float>(n), width,
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

void BoardRenderer::add_row(int fine_y, const ToTexels& map, const Plane& print, float scale, bool bare,
                            float* sum) const {
  const int fine_width = 2 * model_.width;
  const Eigen::Vector3f* bearings = bearings_.data() + static_cast<std::ptrdiff_t>(fine_y) * fine_width;
  const auto paper_width = static_cast<float>((high_m_.x() - low_m_.x()) / texel_m_) * scale;
  const auto paper_height = static_cast<float>((high_m_.y() - low_m_.y()) / texel_m_) * scale;
  const float wall_scale = 1 / (scale * wall_coarser);
  for (int x = 0; x < fine_width; ++x) {
    const Eigen::Vector3f d = map * bearings[x];
    if (!(d.z() > 1e-6f)) {  // beside the wall, or nothing that the lens sees
      sum[x] += static_cast<float>(scene_.wall_grey);
      continue;
    }
    const float s = scale / d.z();
    const float u = d.x() * s, v = d.y() * s;
    if (bare || !(u >= 0 && v >= 0 && u < paper_width && v < paper_height)) {
      const auto wu = static_cast<long>(std::floor(u * wall_scale)) & (wall_texels - 1);
      const auto wv = static_cast<long>(std::floor(v * wall_scale)) & (wall_texels - 1);
      sum[x] += wall_.texels[static_cast<std::size_t>(wv * wall_texels + wu)];
      continue;
    }
    const float tu = std::clamp(u - 0.5f, 0.0f, static_cast<float>(print.width) - 1.001f);
    const float tv = std::clamp(v - 0.5f, 0.0f, static_cast<float>(print.height) - 1.001f);
    const int iu = static_cast<int>(tu), iv = static_cast<int>(tv);
    const float fu = tu - static_cast<float>(iu), fv = tv - static_cast<float>(iv);
    const std::uint8_t* p = print.texels.data() + static_cast<std::ptrdiff_t>(iv) * print.width + iu;
    const float top = static_cast<float>(p[0]) + fu * static_cast<float>(p[1] - p[0]);
    const float bottom =
        static_cast<float>(p[print.width]) + fu * static_cast<float>(p[print.width + 1] - p[print.width]);
    sum[x] += top + fv * (bottom - top);
  }
}

}  // namespace takt
